# Runs a node or a scene, named in PAPILLA_NODE, until it has shown a map, or felt something. PAPILLA_PICTURE: what the scene then
# looks like goes into that file.
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
		_node.get_node("Session").connect("touched", self, "_on_map")
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
	var is_scene = _node.get("touches") != null
	if _maps > 0 and (not is_scene or _node.touches >= 20 and _node.get_node("Arrow").transform.basis.y.length() > 0.2 * _node.arrow_m_per_n):
		if is_scene:
			print("touched %d times in %d answers" % [_node.touches, _maps])
		_save(OS.get_environment("PAPILLA_PICTURE"))
		quit(0)
		return true
	if OS.get_ticks_msec() > PATIENCE_MS:
		print("%d answers in %d ms" % [_maps, PATIENCE_MS])
		quit(1)
		return true
	return false


func _save(file):
	if file == "":
		return
	var picture = root.get_texture().get_data()
	picture.flip_y()
	picture.save_png(file)
