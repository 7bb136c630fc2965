# Places that no case of the service reaches: what is no place, what is drawn.
extends SceneTree

const Frames = preload("res://addons/papilla/frames.gd")

var failures = 0


func _initialize():
	var level = Transform(Basis(), Vector3(0, 1, 0))
	_near("level", Frames.row_of(level, Transform(Basis(), Vector3(0.002, 0.992, 0.01125))), [11.25, 2, -8, 0, 0, 0, 1])
	# Turned to the right by 90 degrees: ahead of the world is its left.
	var turn = Basis(Vector3(0, 1, 0), -PI / 2)
	_near("right", Frames.row_of(Transform(turn, Vector3()), Transform(turn, Vector3(0, 0, -0.01))), [0, -10, 0, 0, 0, 0, 1])
	_near("large", Frames.row_of(level, Transform(Basis().scaled(Vector3(3, 3, 3)), Vector3(0.024, 0.904, 0.135)), 12.0), [11.25, 2, -8, 0, 0, 0, 1])
	var at = Vector3(11.25, 2, -6.5)
	var drawn = Frames.drawn(at)
	_near("drawn", Frames.row_of(Transform(), Transform(Basis(), drawn)), [11.25, 2, -6.5, 0, 0, 0, 1])
	if Frames.vertex_mm(drawn).distance_to(at) > 1e-4:
		_fail("vertex_mm")
	# Each of these tells an error.
	for wrong in [Transform(Basis(), Vector3(0, NAN, 0)), Transform(Basis().scaled(Vector3(1, 0, 1)), Vector3()), Transform(Basis().scaled(Vector3(1, -1, 1)), Vector3())]:
		if Frames.row_of(wrong, level) != null or Frames.row_of(level, wrong) != null or Frames.finger_of_joints(wrong, level) != null:
			_fail("%s is taken" % wrong)
	if Frames.row_of(level, level, 0.0) != null or Frames.finger_of_joints(level, level) != null:
		_fail("no scale or no finger is taken")
	print("frames: %d checks failed" % failures if failures else "frames: all checks passed")
	quit(1 if failures else 0)


func _near(what, found, due):
	for k in 7:
		if found == null or not abs(found[k] - due[k]) < 1e-3:
			_fail("%s: %s, not %s" % [what, found, due])
			return


func _fail(why):
	print("FAILED: ", why)
	failures += 1
