# Generated: run clients/godot/generate, which makes it of clients/godot/godot3/addons/papilla/samples.gd. Edit that file, not this one.
# Samples of maps as they travel, and as arrays of floats.
extends RefCounted

const Compat = preload("compat.gd")
const SIDE_PX = 224
const MAP_LEN = SIDE_PX * SIDE_PX
const TYPES = ["f32", "f16", "u16", "u8"]
const BYTES = [4, 2, 2, 1]


# Samples of `type` (a place in TYPES); `scale`: Pa per unit of u16 and u8.
static func encode(values, type, scale):
	if type == 0:
		return Compat.floats_to_bytes(values)
	if type == 1:
		return Compat.floats_to_halves(values)
	var bytes = PackedByteArray()
	var count = values.size()
	bytes.resize(count * BYTES[type])
	var per_pa = 1.0 / scale
	if type == 3:
		for i in count:
			bytes[i] = int(clamp(values[i] * per_pa + 0.5, 0, 255))
		return bytes
	for i in count:
		var unit = int(clamp(values[i] * per_pa + 0.5, 0, 65535))
		bytes[2 * i] = unit & 255
		bytes[2 * i + 1] = unit >> 8
	return bytes


# Floats of samples.
static func decode(bytes, type, scale):
	if type == 0:
		return Compat.bytes_to_floats(bytes)
	if type == 1:
		return Compat.halves_to_floats(bytes)
	var values = PackedFloat32Array()
	var count = bytes.size() / BYTES[type]
	values.resize(count)
	if type == 3:
		for i in count:
			values[i] = bytes[i] * scale
	else:
		for i in count:
			values[i] = (bytes[2 * i] | bytes[2 * i + 1] << 8) * scale
	return values
