# Where the finger is: of a tracked hand (OpenXR, Godot 4.3 and newer), or of the mouse.
extends Node3D

const JointFrames = preload("res://addons/papilla/frames.gd")
const TRACKER = "/user/hand_tracker/right"

# Numbers of XRHandTracker's joints, which Godot 4.2 has no names for.
const INDEX_DISTAL = 9
const INDEX_TIP = 10

var _is_centred := false


func begin_tracking():
	var openxr := XRServer.find_interface("OpenXR")
	if openxr != null and openxr.is_initialized():
		get_viewport().use_xr = true


# The finger's global transform; null: no hand is tracked.
func tracked_finger():
	var tracker = XRServer.get_tracker(TRACKER)
	if tracker == null or not tracker.has_method("get_hand_joint_transform") or not tracker.has_tracking_data:
		return null
	if not _is_centred:
		# The objects lie before and below the eyes, wherever the headset was put on.
		_is_centred = true
		XRServer.center_on_hmd(XRServer.RESET_BUT_KEEP_TILT, true)
		$Rig.position = Vector3(0, 0.25, 0.4)
	var rig: Transform3D = $Rig.global_transform
	var distal: Transform3D = tracker.get_hand_joint_transform(INDEX_DISTAL)
	var tip: Transform3D = tracker.get_hand_joint_transform(INDEX_TIP)
	return JointFrames.finger_of_joints(rig * distal, rig * tip, Vector3(0, 0, -1))


# The mouse in the window while its left button is held, 0 to 1 from the left and from above; null: it is not.
func place_of_mouse():
	if not Input.is_mouse_button_pressed(MOUSE_BUTTON_LEFT):
		return null
	return get_viewport().get_mouse_position() / get_viewport().get_visible_rect().size
