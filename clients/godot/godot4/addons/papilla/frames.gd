# Generated: run clients/godot/generate, which makes it of clients/godot/godot3/addons/papilla/frames.gd. Edit that file, not this one.
# Where nodes are in the finger's frame, and forces back (docs/reference/frames-and-units.md).
#
# Godot's world is right-handed, metres: x right, y up, -z ahead. A finger's -z points to its tip, its y out of the nail;
# its origin is the foremost point of the skin. The finger's frame: x back along the finger, y right, z out of the nail,
# mm. So (x, y, z) of the frame are (z, x, y) of Godot's axes, of a finger and of an object alike.
extends RefCounted

const MM_PER_UNIT = 1000.0


# The row of an object for `send_poses`: its origin in the finger's frame, mm, and a unit quaternion x y z w. Both are
# global transforms; `scale` says how many times as large as life all is drawn. Where one is no place (NaN, flat,
# mirrored): an error, and null; leave that frame out.
static func row_of(finger, object, scale = 1.0):
	if not (_is_place("finger", finger) and _is_place("object", object) and _is_scale(scale)):
		return null
	var back = finger.basis.orthonormalized().transposed()
	var off = object.origin - finger.origin
	var at = back * off * (MM_PER_UNIT / scale)
	var turn = (back * object.basis.orthonormalized()).get_rotation_quaternion()
	return [at.z, at.x, at.y, turn.z, turn.x, turn.y, turn.w]


# The finger's transform, of two joints: that of the distal phalanx and the tip. It points from the one to the other, its
# nail the way of the distal joint's axis `up`: -z of Godot's XRHandTracker, +y of OpenXR. The tip's joint is the frame's
# origin, or lies `inside_mm` behind it. Left and right hands are the same: the model's finger is symmetric. Where the
# joints are no finger: an error, and null.
static func finger_of_joints(distal, tip, up = Vector3(0, 0, -1), inside_mm = 0.0):
	if not (_is_place("distal", distal) and _is_place("tip", tip)):
		return null
	var back = distal.origin - tip.origin
	if not back.length() * MM_PER_UNIT >= 1.0:
		push_error("Papilla: distal and tip are the same place")
		return null
	back = back.normalized()
	var nail = distal.basis.orthonormalized() * up
	nail -= back * back.dot(nail)
	if not nail.length() >= 1e-3:
		push_error("Papilla: up points along the finger; it is the distal joint's axis that points out of the nail")
		return null
	nail = nail.normalized()
	return Transform3D(Basis(nail.cross(back), nail, back), tip.origin - back * (inside_mm / MM_PER_UNIT))


# What pushes back on the finger (`answer.touch`), in the world: force_n, for `apply_force`; torque_n_m about the finger's
# origin; centre of the pressure. An object feels the opposite.
static func felt(finger, touch, scale = 1.0):
	if not (_is_place("finger", finger) and _is_scale(scale)):
		return null
	var turn = finger.basis.orthonormalized()
	var force = _out(touch.force_n)
	var torque = _out(touch.torque_n_mm) / MM_PER_UNIT
	var centre = _out(touch.centre_mm) * (scale / MM_PER_UNIT)
	return {"force_n": turn * force, "torque_n_m": turn * torque, "centre": finger.origin + turn * centre}


# A place of the finger's frame, mm (a vertex of the atlas), in the drawn finger's own axes, m. Turn the triangles: Godot
# shows those that are clockwise.
static func drawn(at_mm):
	return _out(at_mm) / MM_PER_UNIT


# A vertex of an object's mesh, in its own axes in Godot, m, for the `vertices_mm` of a hello. Turn its triangles.
static func vertex_mm(at):
	return Vector3(at.z, at.x, at.y) * MM_PER_UNIT


static func _out(v):
	return Vector3(v.y, v.z, v.x)


static func _is_place(what, transform):
	var volume = transform.basis.determinant()
	var sum = volume + transform.origin.x + transform.origin.y + transform.origin.z
	if is_nan(sum) or is_inf(sum) or not volume > 1e-12:
		push_error("Papilla: %s is no place: it is not finite, flat or mirrored; while the hand is not tracked call send_not_tracked" % what)
		return false
	return true


static func _is_scale(scale):
	if scale > 0 and not is_inf(scale):
		return true
	push_error("Papilla: scale says how many times as large as life all is drawn; it is %s" % scale)
	return false
