# Generated: run clients/godot/generate, which makes it of clients/godot/godot3/addons/papilla/touch.gd. Edit that file, not this one.
# Where things are and what pushes back, as they travel.
extends RefCounted

const Compat = preload("compat.gd")
const ROW_LEN = 7


# Rows of seven numbers, and the net force behind them, as bytes.
static func poses(rows, net):
	var values = PackedFloat32Array()
	for row in rows:
		values.append_array(PackedFloat32Array(row))
	return Compat.floats_to_bytes(values) + _net(net)


# Depths and the net force behind them, as bytes.
static func gaps(depth_mm, net):
	return Compat.floats_to_bytes(PackedFloat32Array(depth_mm)) + _net(net)


# [x, y, z, N]: a unit vector and the force along it; null: none is asked.
static func _net(net):
	return PackedByteArray() if net == null else Compat.floats_to_bytes(PackedFloat32Array(net + [0, 0, 0]))


# What the section says.
static func read(v):
	return {
		"force_n": Vector3(v[0], v[1], v[2]),
		"torque_n_mm": Vector3(v[3], v[4], v[5]),
		"area_mm2": v[6],
		"centre_mm": Vector3(v[7], v[8], v[9]),
		"penetration_mm": v[10],
		"stiffness_n_per_mm": v[11],
		"travel_mm": v[12],
		"pressure_max_pa": v[13],
		"share": v[14],
		"solve_us": v[15],
	}
