# What Godot 3 and Godot 4 do differently. This file is for Godot 3.
#
# A loop over 50176 samples takes GDScript many milliseconds, so f32 goes through var2bytes and bytes2var, which are
# native: a PoolRealArray is there its type, its length and the floats themselves.
extends Reference

const HALF_MAX = 65504.0
# Threes of samples in a map, rounded up.
const THREES = 16726


# A map of 224 x 224 zeros.
static func zeros():
	var image = Image.new()
	# New images are black: a native way to 50176 zeros.
	image.create(224, 224, false, Image.FORMAT_RF)
	return bytes_to_floats(image.get_data())


# The same in threes of samples, as a PoolVector3Array; the last has two to spare.
static func zero_threes():
	var image = Image.new()
	image.create(6, THREES / 2, false, Image.FORMAT_RF)
	return _whole(TYPE_VECTOR3_ARRAY, THREES, image.get_data())


# Such threes, times a number.
static func scaled_threes(threes, factor):
	return Transform(Basis().scaled(Vector3(factor, factor, factor)), Vector3()).xform(threes)


# Such threes as a map.
static func threes_to_floats(threes):
	var bytes = var2bytes(threes)
	return _whole(TYPE_REAL_ARRAY, 224 * 224, bytes.subarray(8, 8 + 4 * 224 * 224 - 1))


# Floats to bytes, f32 little-endian.
static func floats_to_bytes(values):
	if values.size() == 0:
		return PoolByteArray()
	var bytes = var2bytes(values)
	return bytes.subarray(8, bytes.size() - 1)


# Bytes of f32 to floats.
static func bytes_to_floats(bytes):
	var count = bytes.size() / 4
	if count == 0:
		return PoolRealArray()
	return _whole(TYPE_REAL_ARRAY, count, bytes)


# An array of a type, of the bytes of its elements.
static func _whole(type, count, bytes):
	var whole = PoolByteArray([type, 0, 0, 0, count & 255, count >> 8 & 255, count >> 16 & 255, count >> 24 & 255])
	whole.append_array(bytes)
	return bytes2var(whole)


# Floats to bytes, f16 little-endian; beyond HALF_MAX they are cut to it.
static func floats_to_halves(values):
	var bytes = PoolByteArray()
	bytes.resize(2 * values.size())
	for i in values.size():
		var bits = _half_bits(values[i])
		bytes[2 * i] = bits & 255
		bytes[2 * i + 1] = bits >> 8
	return bytes


# Bytes of f16 to floats.
static func halves_to_floats(bytes):
	var values = PoolRealArray()
	values.resize(bytes.size() / 2)
	for i in values.size():
		values[i] = _half_value(bytes[2 * i] | bytes[2 * i + 1] << 8)
	return values


# Bits of the nearest f16, ties to even. Pressure is not negative; what is goes out as -0 .. -HALF_MAX and is refused.
static func _half_bits(value):
	if is_nan(value):
		return 0x7e00
	var sign_bit = 0x8000 if value < 0 else 0
	var size = abs(value)
	if is_inf(size):
		return sign_bit | 0x7c00
	size = min(size, HALF_MAX)
	var exponent = -14
	while exponent < 15 and size >= pow(2, exponent + 1):
		exponent += 1
	var unit = size / pow(2, exponent - 10)
	var whole = int(floor(unit))
	var rest = unit - whole
	if rest > 0.5 or (rest == 0.5 and whole & 1):
		whole += 1
	# 1024 units of the lowest exponent are the first normal number; a carry raises the exponent.
	return sign_bit | (((exponent + 14) << 10) + whole)


static func _half_value(bits):
	var exponent = bits >> 10 & 31
	var fraction = bits & 1023
	var size = fraction * pow(2, -24) if exponent == 0 else (1024 + fraction) * pow(2, exponent - 25)
	if exponent == 31:
		size = INF if fraction == 0 else NAN
	return -size if bits & 0x8000 else size


# Starts to connect an HTTPClient.
static func connect_http(http, host, port, is_tls):
	http.connect_to_host(host, port, is_tls)


# A Dictionary as JSON.
static func json_text(message):
	return JSON.print(message)
