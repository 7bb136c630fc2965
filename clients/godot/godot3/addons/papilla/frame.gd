# Frames of the protocol: a header of 48 bytes, little-endian, and what follows.
extends Reference

const Compat = preload("compat.gd")
const Samples = preload("samples.gd")
const Touch = preload("touch.gd")
const STATUS = ["ok", "superseded", "late", "error", "stale"]
const VERSION = 3
const HEADER_BYTES = 48
const KIND_PRESSURE = 1
const KIND_OBJECTS = 4
const KIND_GAPS = 5
const NOT_TRACKED = 32
# Before the samples of the section `rates`: their scale, and zeros.
const RATES_HEAD_BYTES = 16


# A request. `scale`: Pa per unit of u16 and u8; null or 0: so that the greatest pressure is the greatest unit.
static func encode(values, column, row, width, height, type_name, scale, sequence, time_us, deadline_us):
	var type = Samples.TYPES.find(type_name)
	if type >= 2:
		if scale == null or scale <= 0:
			var most = 0.0
			for value in values:
				most = max(most, value)
			scale = most / (65535.0 if type == 2 else 255.0) if most > 0 else 1.0
	if type < 2:
		scale = 1.0
	var window = [column, row, width, height]
	var frame = _header(KIND_PRESSURE, type, window, scale, 0, sequence, time_us, deadline_us)
	frame.append_array(Samples.encode(values, type, scale))
	return frame


# A request of poses or gaps (`bytes`, f32) of a finger.
static func encode_rows(kind, bytes, width, height, finger, sequence, time_us, deadline_us):
	var frame = _header(kind, 0, [0, 0, width, height], 1.0, finger, sequence, time_us, deadline_us)
	frame.append_array(bytes)
	return frame


# That nobody knows where things are: a header alone, whose kind and sample type mean nothing.
static func encode_not_tracked(finger, sequence, time_us, deadline_us):
	return _header(KIND_PRESSURE, 0, [0, 0, 0, 0], 1.0, finger, sequence, time_us, deadline_us, NOT_TRACKED)


# The header.
static func _header(kind, type, window, scale, finger, sequence, time_us, deadline_us, flags = 0):
	var head = StreamPeerBuffer.new()
	head.put_data("PPL1".to_ascii())
	for byte in [VERSION, kind, type, 0]:
		head.put_u8(byte)
	head.put_u32(sequence)
	head.put_u16(window[2])
	head.put_u16(window[3])
	head.put_u64(time_us)
	head.put_u32(deadline_us)
	head.put_float(scale)
	head.put_u16(window[0])
	head.put_u16(window[1])
	head.put_u64(0)
	head.put_u16(0)
	head.put_u8(flags)
	head.put_u8(finger)
	return head.data_array


# What the header of an answer says.
static func read_header(packet):
	var head = StreamPeerBuffer.new()
	head.data_array = packet.subarray(0, HEADER_BYTES - 1)
	# Behind the version, and the kind: SED.
	head.seek(6)
	var answer = {"sample_type": head.get_u8(), "status": STATUS[head.get_u8()]}
	answer.sequence = head.get_u32()
	answer.width = head.get_u16()
	answer.height = head.get_u16()
	answer.client_time_us = head.get_u64()
	answer.total_us = head.get_u32()
	answer.scale = head.get_float()
	answer.column = head.get_u16()
	answer.row = head.get_u16()
	answer.queue_us = head.get_u32()
	answer.infer_us = head.get_u32()
	answer.tier_number = head.get_u16()
	var flags = head.get_u8()
	answer.out_of_range = flags & 1 != 0
	answer.no_contact = flags & 2 != 0
	answer.unfamiliar = flags & 4 != 0
	answer.unsettled = flags & 8 != 0
	answer.cut_off = flags & 16 != 0
	answer.not_tracked = flags & NOT_TRACKED != 0
	answer.coarse_clock = flags & 64 != 0
	answer.finger = head.get_u8()
	return answer


# What follows the header, by the `sections` of the session's ready.
static func read_sections(answer, packet, sections):
	answer.samples = PoolByteArray()
	answer.has_map = false
	for section in sections:
		var from = int(section.offset)
		if section.name == "map":
			answer.has_map = true
			if from < packet.size():
				answer.samples = packet.subarray(from, packet.size() - 1)
		elif section.name == "rates":
			# Firing rates, Hz: a whole map, or a value a vertex.
			var scale = Compat.bytes_to_floats(packet.subarray(from, from + 4 - 1))[0]
			answer.rates_hz = Samples.decode(packet.subarray(from + RATES_HEAD_BYTES, from + int(section.bytes) - 1), answer.sample_type, scale)
		elif section.name == "point_rates":
			answer.point_rates_hz = Compat.bytes_to_floats(packet.subarray(from, from + int(section.bytes) - 1))
		elif section.name == "vertices":
			answer.vertices = Samples.decode(packet.subarray(from, from + int(section.bytes) - 1), answer.sample_type, answer.scale)
		elif section.name == "error_estimate":
			# How wrong this answer is likely to be, relative to finite elements; what is not stated is infinite.
			var errors = Compat.bytes_to_floats(packet.subarray(from, from + int(section.bytes) - 1))
			answer.error_estimate = {"sed_median": errors[0], "sed_p90": errors[1], "force_median": errors[2], "force_p90": errors[3]}
		elif section.name == "spikes":
			_read_spikes(answer, packet, from)
		elif section.name == "touch":
			answer.touch = Touch.read(Compat.bytes_to_floats(packet.subarray(from, from + int(section.bytes) - 1)))
		else:
			answer[section.name] = Compat.bytes_to_floats(packet.subarray(from, from + int(section.bytes) - 1))
	if not answer.has_map:
		answer.width = 0
		answer.height = 0


# Numbers of the units that fired, in ready's `units`, and when, us, by the client's clock; those of the finger since the hello too.
static func _read_spikes(answer, packet, from):
	var section = StreamPeerBuffer.new()
	section.data_array = packet.subarray(from, packet.size() - 1)
	answer.spikes_total = section.get_u32()
	answer.spikes = []
	for _k in section.get_u32():
		var unit = section.get_u16()
		answer.spikes.append({"unit": unit, "time_us": answer.client_time_us - section.get_u16()})


# The map of an answer with status ok: 224 x 224 floats. f32 is fast; other types take a loop over the window.
# An answer without a map has none: an error, and no samples.
static func map_of(answer):
	if not answer.get("has_map", false):
		push_error("papilla: the answer carries no map; its status is " + answer.status)
		return PoolRealArray()
	var values = Samples.decode(answer.samples, answer.sample_type, answer.scale)
	if answer.width == Samples.SIDE_PX and answer.height == Samples.SIDE_PX:
		return values
	var map = Compat.zeros()
	for y in answer.height:
		for x in answer.width:
			map[(answer.row + y) * Samples.SIDE_PX + answer.column + x] = values[y * answer.width + x]
	return map


# SED, J/m3: the map of an answer, or the values at the vertices. Null, and an error that says why, where it carries neither.
static func sed_of(answer):
	if answer.get("width", 0) > 0 or answer.get("has_map", false):
		return map_of(answer)
	if answer.has("vertices"):
		return answer.vertices
	push_error("the answer carries no SED: its frame was not rendered, or the hello asks for no map")
	return null


# Firing rates, Hz, where SED is. Null, and an error that says why, where the answer carries none.
static func rates_hz_of(answer):
	if answer.has("rates_hz"):
		return answer.rates_hz
	push_error("the answer carries no rates: name the effect 'afferents' in the hello, and leave 'map' true")
	return null


# The window of an answer as a picture for a texture, without a loop: f32 (red in J/m3), f16 or u8 (red 1 is 255 x answer.scale).
static func image_of(answer):
	var formats = [Image.FORMAT_RF, Image.FORMAT_RH, -1, Image.FORMAT_R8]
	var format = formats[answer.sample_type]
	if format < 0 or answer.width == 0:
		return null
	var image = Image.new()
	image.create_from_data(answer.width, answer.height, false, format, answer.samples)
	return image
