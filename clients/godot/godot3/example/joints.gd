# Where the finger is: of a tracked hand, or of the mouse. Godot 3 tracks no hands by itself: a plugin for OpenXR gives nodes for joints,
# whose paths are to be set here.
extends Spatial

const JointFrames = preload("res://addons/papilla/frames.gd")

# Nodes at the joints of the right index finger, with OpenXR's own axes.
export var distal_path = NodePath()
export var tip_path = NodePath()


func begin_tracking():
	pass


# The finger's global transform; null: no hand is tracked.
func tracked_finger():
	var distal = get_node_or_null(distal_path)
	var tip = get_node_or_null(tip_path)
	if distal == null or tip == null or not tip.is_visible_in_tree():
		return null
	return JointFrames.finger_of_joints(distal.global_transform, tip.global_transform, Vector3(0, 1, 0))


# The mouse in the window while its left button is held, 0 to 1 from the left and from above; null: it is not.
func place_of_mouse():
	if not Input.is_mouse_button_pressed(BUTTON_LEFT):
		return null
	return get_viewport().get_mouse_position() / get_viewport().get_visible_rect().size
