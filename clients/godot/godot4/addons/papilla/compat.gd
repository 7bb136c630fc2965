# What Godot 3 and Godot 4 do differently. This file is for Godot 4.
extends RefCounted

const HALF_MAX = 65504.0
# Threes of samples in a map, rounded up.
const THREES = 16726


# A map of 224 x 224 zeros.
static func zeros():
	var map = PackedFloat32Array()
	# New room is filled with zeros.
	map.resize(224 * 224)
	return map


# The same in threes of samples, as a PackedVector3Array; the last has two to spare.
static func zero_threes():
	var threes = PackedVector3Array()
	threes.resize(THREES)
	threes.fill(Vector3())
	return threes


# Such threes, times a number.
static func scaled_threes(threes, factor):
	return Transform3D(Basis().scaled(Vector3(factor, factor, factor)), Vector3()) * threes


# Such threes as a map.
static func threes_to_floats(threes):
	return threes.to_byte_array().to_float32_array().slice(0, 224 * 224)


# Floats to bytes, f32 little-endian.
static func floats_to_bytes(values):
	return values.to_byte_array()


# Bytes of f32 to floats.
static func bytes_to_floats(bytes):
	return bytes.to_float32_array()


# Floats to bytes, f16 little-endian; beyond HALF_MAX they are cut to it.
static func floats_to_halves(values):
	var bytes = PackedByteArray()
	bytes.resize(2 * values.size())
	for i in values.size():
		bytes.encode_half(2 * i, clamp(values[i], -HALF_MAX, HALF_MAX))
	return bytes


# Bytes of f16 to floats.
static func halves_to_floats(bytes):
	var values = PackedFloat32Array()
	values.resize(bytes.size() / 2)
	for i in values.size():
		values[i] = bytes.decode_half(2 * i)
	return values


# Starts to connect an HTTPClient.
static func connect_http(http, host, port, is_tls):
	http.connect_to_host(host, port, TLSOptions.client() if is_tls else null)


# A Dictionary as JSON.
static func json_text(message):
	return JSON.stringify(_whole(message))


# Whole numbers as integers: Godot 4 writes 10.0 for a float, and the server wants 10 where a count is due.
static func _whole(value):
	if value is Dictionary:
		var members = {}
		for key in value:
			members[key] = _whole(value[key])
		return members
	if value is Array:
		return value.map(_whole)
	return int(value) if value is float and value == floor(value) else value
