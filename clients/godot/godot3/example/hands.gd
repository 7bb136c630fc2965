# Three objects to touch: a ball of rubber, a plate and a bar. The finger shows the strain energy density under its skin, the arrow the
# force on it. The finger is that of a tracked hand (joints.gd); without one it visits the objects by itself, and follows the
# mouse while its left button is held.
extends "res://example/joints.gd"

const Atlas = preload("res://addons/papilla/atlas.gd")
const Device = preload("res://addons/papilla/device.gd")
const Frames = preload("res://addons/papilla/frames.gd")
const Hello = preload("res://addons/papilla/hello.gd")
const Http = preload("res://addons/papilla/http.gd")
const PITCH_M = 0.03
const SENT_MAX = 256
const PALE = Color(0.86, 0.66, 0.56)
const DARK = Color(0.47, 0.0, 0.24)
# The skin is drawn so much above what it touches, or both surfaces would show through each other.
const LIFT_MM = Vector3(0, 0, 0.1)

# SED that is drawn in the darkest colour, J/m3.
export var sed_of_darkest = 100.0
# Length of the arrow for 1 N, m.
export var arrow_m_per_n = 0.06

# Answers in which something was touched.
var touches = 0

# Where the finger was in the last frames, by their sequences: it is drawn where it was when it felt what comes back.
var _sent = []
var _was_tracked = false
# The first gamepad feels the size of the force.
var _motor = Device.new()
var _arrays = []
# The skin's vertices, mm in the finger's frame.
var _skin_mm = PoolVector3Array()

onready var session = $Session
onready var finger = $Finger
onready var arrow = $Arrow
onready var objects = [$Ball, $Plate, $Bar]


# Before the session opens: children become ready before this node does.
func _enter_tree():
	var rubber = Hello.TouchMaterial.new().with({"stiffness_mpa_per_mm": 0.05, "friction": 0.5})
	var ball = Hello.TouchObject.new().with({"shape": Hello.ShapeSphere.new().with({"radius_mm": 10.0}), "material": rubber})
	var plate = Hello.TouchObject.new().with({"shape": Hello.ShapePlate.new()})
	var bar = Hello.TouchObject.new().with({"shape": Hello.ShapeCylinder.new()})
	$Session.hello = Hello.new().with({
		"objects": [ball, plate, bar],
		"answer_layout": "vertices",
		"displacement": true,
		"effects": [Hello.ShearEnergyEffect.new()],
	})


func _ready():
	_sent.resize(SENT_MAX)
	begin_tracking()
	_draw_finger(Atlas.new(Http.atlas_text(session.url, session.token)))
	session.connect("answered", self, "_on_answered")


func _process(_delta):
	var command = _motor.poll()
	if command != null:
		Input.start_joy_vibration(0, command.amplitude, command.amplitude, command.duration_s)
	var tracked = tracked_finger()
	_was_tracked = _was_tracked or tracked != null
	# A hand that was there and is lost is told as that: nothing is felt until it is back.
	if _was_tracked and tracked == null:
		_sent[session.send_not_tracked() % SENT_MAX] = null
		return
	var hand = _without_hand() if tracked == null else tracked
	var rows = []
	for each in objects:
		rows.append(Frames.row_of(hand, each.global_transform))
	_sent[session.send_poses(rows) % SENT_MAX] = hand


# Where the pad presses so deep at this place beside the middle object; the scene's origin is the middle of the objects' tops.
func _finger_at(beside_m, depth_m):
	return Transform(Basis(), Vector3(beside_m, 0.0065 - depth_m, -0.01125))


func _without_hand():
	var place = place_of_mouse()
	if place != null:
		return _finger_at(3.0 * PITCH_M * (place.x - 0.5), 0.001 - 0.008 * (1.0 - place.y))
	# From object to object in two seconds each, down by 1 mm into it and up again.
	var turn = OS.get_ticks_msec() / 2000.0
	return _finger_at(PITCH_M * (int(turn) % 3 - 1), 0.003 * sin(TAU * turn - PI / 2) - 0.002)


# No answer came in time, or the server refuses: nothing is felt, and actuators go to zero, until the next answer.
func _on_answered(answer):
	_motor.feed(answer)
	var hand = _sent[answer.sequence % SENT_MAX]
	# One that was superseded at once has its outcome before its place is kept.
	if hand != null and answer.status != "superseded":
		finger.global_transform = hand
	if answer.status == "ok" and not answer.no_contact:
		touches += 1
		_show_force(Frames.felt(finger.global_transform, answer.touch))
		_paint(session.sed_of(answer), answer.displacement)
	elif answer.status == "ok" or answer.status == "lost" or answer.status == "error":
		arrow.visible = false
		_paint(null, null)


func _show_force(felt):
	var length = arrow_m_per_n * felt.force_n.length()
	arrow.visible = length > 0.0
	if length == 0.0:
		return
	var along = felt.force_n.normalized()
	var aside = along.cross(Vector3(0, 0, 1) if abs(along.z) < 0.9 else Vector3(1, 0, 0)).normalized()
	arrow.global_transform = Transform(Basis(length * aside, length * along, length * aside.cross(along)), felt.centre)


func _draw_finger(atlas):
	var vertices = PoolVector3Array()
	for i in atlas.vertex_count():
		_skin_mm.append(Vector3(atlas.skin_mm[3 * i], atlas.skin_mm[3 * i + 1], atlas.skin_mm[3 * i + 2]))
		vertices.append(Frames.drawn(_skin_mm[i]))
	var normals = []
	for _i in vertices.size():
		normals.append(Vector3())
	# Godot takes clockwise triangles as front faces.
	var indices = PoolIntArray()
	for t in atlas.triangles.size() / 3:
		var a = atlas.triangles[3 * t]
		var b = atlas.triangles[3 * t + 1]
		var c = atlas.triangles[3 * t + 2]
		for corner in [a, c, b]:
			indices.append(corner)
			normals[corner] += (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a])
	for i in normals.size():
		normals[i] = normals[i].normalized()
	_arrays.resize(Mesh.ARRAY_MAX)
	_arrays[Mesh.ARRAY_VERTEX] = vertices
	_arrays[Mesh.ARRAY_NORMAL] = PoolVector3Array(normals)
	_arrays[Mesh.ARRAY_INDEX] = indices
	_paint(null, null)


# SED (J/m3) at the vertices and how far they have moved (mm, x y z each); null: nothing is felt.
func _paint(sed, moved_mm):
	if _arrays.empty():
		return
	var vertices = PoolVector3Array()
	var colours = PoolColorArray()
	for i in _skin_mm.size():
		var moved = Vector3() if moved_mm == null else Vector3(moved_mm[3 * i], moved_mm[3 * i + 1], moved_mm[3 * i + 2]) + LIFT_MM
		vertices.append(Frames.drawn(_skin_mm[i] + moved))
		var colour = PALE.linear_interpolate(DARK, 0.0 if sed == null else clamp(sed[i] / sed_of_darkest, 0.0, 1.0))
		# The material takes no light, so that SED has one colour everywhere; what faces down is a little darker.
		var shade = 0.85 + 0.15 * _arrays[Mesh.ARRAY_NORMAL][i].y
		colours.append(Color(shade * colour.r, shade * colour.g, shade * colour.b))
	_arrays[Mesh.ARRAY_VERTEX] = vertices
	_arrays[Mesh.ARRAY_COLOR] = colours
	var mesh = ArrayMesh.new()
	mesh.add_surface_from_arrays(Mesh.PRIMITIVE_TRIANGLES, _arrays)
	finger.mesh = mesh
