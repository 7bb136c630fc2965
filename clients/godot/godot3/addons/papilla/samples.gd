# Samples of maps as they travel, and as arrays of floats.
#
# A loop over 50176 samples takes GDScript many milliseconds, so f32 goes through var2bytes and bytes2var, which are
# native: a PoolRealArray is there its type, its length and the floats themselves.
extends Reference

const SIDE_PX = 224
const MAP_LEN = SIDE_PX * SIDE_PX
const TYPES = ["f32", "f16", "u16", "u8"]
const BYTES = [4, 2, 2, 1]
const HALF_MAX = 65504.0


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
	var whole = PoolByteArray([TYPE_REAL_ARRAY, 0, 0, 0, count & 255, count >> 8 & 255, count >> 16 & 255, count >> 24 & 255])
	whole.append_array(bytes)
	return bytes2var(whole)


# Samples of `type` (a place in TYPES); `scale`: Pa per unit of u16 and u8.
static func encode(values, type, scale):
	if type == 0:
		return floats_to_bytes(values)
	var bytes = PoolByteArray()
	var count = values.size()
	bytes.resize(count * BYTES[type])
	var per_pa = 1.0 / scale if type >= 2 else 1.0
	if type == 3:
		for i in count:
			bytes[i] = int(clamp(values[i] * per_pa + 0.5, 0, 255))
		return bytes
	for i in count:
		var unit = int(clamp(values[i] * per_pa + 0.5, 0, 65535)) if type == 2 else to_half(values[i])
		bytes[2 * i] = unit & 255
		bytes[2 * i + 1] = unit >> 8
	return bytes


# Floats of samples.
static func decode(bytes, type, scale):
	if type == 0:
		return bytes_to_floats(bytes)
	var values = PoolRealArray()
	var count = bytes.size() / BYTES[type]
	values.resize(count)
	if type == 3:
		for i in count:
			values[i] = bytes[i] * scale
	elif type == 2:
		for i in count:
			values[i] = (bytes[2 * i] | bytes[2 * i + 1] << 8) * scale
	else:
		for i in count:
			values[i] = from_half(bytes[2 * i] | bytes[2 * i + 1] << 8)
	return values


# Bits of the nearest f16, ties to even. Pressure is not negative; what is goes out as -0 .. -HALF_MAX and is refused.
static func to_half(value):
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


static func from_half(bits):
	var exponent = bits >> 10 & 31
	var fraction = bits & 1023
	var size = fraction * pow(2, -24) if exponent == 0 else (1024 + fraction) * pow(2, exponent - 25)
	if exponent == 31:
		size = INF if fraction == 0 else NAN
	return -size if bits & 0x8000 else size
