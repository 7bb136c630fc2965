# Runs a node or a scene until it has shown maps, named in PAPILLA_NODE.
extends SceneTree

const PATIENCE_MS = 60000

var _node
var _maps = 0
var _last = null
var _url = OS.get_environment("PAPILLA_URL")


func _initialize():
	var path = OS.get_environment("PAPILLA_NODE")
	if path.ends_with(".tscn"):
		_node = load(path).instance()
		_node.get_node("Session").url = _url
		_node.get_node("Session").hello = preload("res://addons/papilla/hello.gd").new().with({"tier": "half-space"})
		_node.get_node("Session").connect("map_received", self, "_on_map")
	else:
		_node = Node.new()
		_node.set_script(load(path))
		_node.session.url = _url
		_node.session.connect("map_received", self, "_on_map")
		# Of a session without maps.
		_node.session.connect("touched", self, "_on_map")
	root.add_child(_node)


func _on_map(answer):
	_maps += 1
	_last = answer


func _idle(_delta):
	var due = 20 if _node.get("maps") != null else 1
	if _maps >= due and (_node.get("maps") == null or _node.maps >= due):
		print("%d maps, the last with %d bytes" % [_maps, _last.samples.size()])
		quit(0)
		return true
	if OS.get_ticks_msec() > PATIENCE_MS:
		print("%d maps in %d ms" % [_maps, PATIENCE_MS])
		quit(1)
		return true
	return false
