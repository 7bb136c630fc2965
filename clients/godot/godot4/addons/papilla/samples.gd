# Samples of maps as they travel, and as arrays of floats.
extends RefCounted

const SIDE_PX = 224
const MAP_LEN = SIDE_PX * SIDE_PX
const TYPES = ["f32", "f16", "u16", "u8"]
const BYTES = [4, 2, 2, 1]
const HALF_MAX = 65504.0


# Samples of `type` (a place in TYPES); `scale`: Pa per unit of u16 and u8.
static func encode(values, type, scale):
	if type == 0:
		return values.to_byte_array()
	var bytes = PackedByteArray()
	var count = values.size()
	bytes.resize(count * BYTES[type])
	var per_pa = 1.0 / scale if type >= 2 else 1.0
	if type == 3:
		for i in count:
			bytes[i] = int(clamp(values[i] * per_pa + 0.5, 0, 255))
		return bytes
	for i in count:
		if type == 2:
			bytes.encode_u16(2 * i, int(clamp(values[i] * per_pa + 0.5, 0, 65535)))
		else:
			bytes.encode_half(2 * i, clamp(values[i], -HALF_MAX, HALF_MAX))
	return bytes


# Floats of samples.
static func decode(bytes, type, scale):
	if type == 0:
		return bytes.to_float32_array()
	var values = PackedFloat32Array()
	var count = bytes.size() / BYTES[type]
	values.resize(count)
	if type == 3:
		for i in count:
			values[i] = bytes[i] * scale
	elif type == 2:
		for i in count:
			values[i] = bytes.decode_u16(2 * i) * scale
	else:
		for i in count:
			values[i] = bytes.decode_half(2 * i)
	return values
