# A session of Papilla: pressure maps (Pa) or poses of objects out, maps of strain energy density (J/m3) and forces in.
#
# Put the node into the scene, connect `map_received` or `touched`, call `send`, `send_window` or `send_poses`. The newest
# frame of a finger wins here too: with `in_flight_max` of its frames without an answer a frame waits, and a newer one
# takes its place. A lost connection is made anew by itself, and the session moves to another when the service asks it to.
# A frame without an answer after `timeout_ms` is lost: set the actuators to zero then.
extends Node

const Address = preload("address.gd")
const Compat = preload("compat.gd")
const Frame = preload("frame.gd")
const Link = preload("link.gd")
const Move = preload("move.gd")
const Samples = preload("samples.gd")
const Touch = preload("touch.gd")

# An answer with a map; see `map_of`, `image_of`.
signal map_received(answer)
# An answer with what pushes back: `answer.finger`, `answer.touch.force_n`, ... (touch.gd).
signal touched(answer)
# What became of a frame, once for each: `answer.status` is ok, superseded, late, stale, error or lost.
signal answered(answer)
# A session began, on the terms of the server's `ready`.
signal session_ready(server_ready)
# A hello was refused.
signal refused(problem)

const ATTEMPT_MS = 5000
const RETRY_LEAST_MS = 100
const RETRY_MOST_MS = 250
const OBJECTS_MAX = 16
const FINGERS_MAX = 10
const PASSING = ["overloaded", "shutting_down", "timeout", "internal", "rate_limited"]

# Where the server is: host, host:port, or a URL (address.gd).
export var url = "http://127.0.0.1:7224"
# Bearer token, for a server that asks for one; blanks around it go.
export var token = ""
# What to ask for: a `Hello` of hello.gd; null: what the service gives without a wish. Set it before the node enters the tree, or before `open`.
var hello = null
# Connect when the scene starts.
export var auto_open = true
# Frames of a finger that may be without an answer. Two fill the server (one rendered, one waiting); more only help over slow networks.
export var in_flight_max = 3
# A frame without an answer for so long is lost, whether it waits for a connection or for the server; in the second case the
# connection is given up and another made.
export var timeout_ms = 5000

# The server's `ready`; null while there is no session. (`ready` itself is a signal of every Node.)
var server_ready = null
# Deadline of the frames to come, us; 0: the session's budget.
var deadline_us = 0
# Time of the frames to come by the client's clock, us; 0: the engine's own.
var client_time_us = 0
# Frames that went out, and frames that a newer one replaced before they left.
var sent = 0
var superseded_by_client = 0
# What people were told so far, each thing once.
var warnings = []
# Connections that the session had: more than 1 after one was lost, or the service asked it to move.
var connections = 0

var _link = null
# Null: the service does not ask for it.
var _move = null
var _is_first_ready = false
var _open = false
var _is_refused = false
var _next_try_ms = 0
var _gives_up_ms = 0
var _sequence = 0
# By finger, those that came last at the end: [frame, sequence].
var _waiting = {}
# Finger by sequence.
var _outstanding = {}
# When a frame without an outcome was handed over, by sequence.
var _born_ms = {}
var _asked = {}
var _before = null
var _older_ready = null
var _renewed_from = 0
var _warned = {}


func _ready():
	if auto_open:
		open()


func _process(_delta):
	poll()


func _exit_tree():
	close()


# Connects, and again whenever the connection is lost.
func open():
	_open = true
	_is_refused = false
	_asked = {} if hello == null else hello.words()
	if not _fault():
		_connect()


func close():
	_open = false
	_drop()
	_lose_all()
	_end_waiting("lost")


# Says another hello in the open session: `session_ready`, or `refused` and the old terms stand.
func renew(next):
	_end_waiting("superseded")
	if server_ready != null:
		_before = {"asked": _asked, "server_ready": server_ready}
	if _move != null and _move.holds():
		# What is sealed is of the old terms.
		_move.put_off(OS.get_ticks_msec())
	_asked = next.words()
	_renewed_from = _sequence + 1
	server_ready = null
	if _link != null and _link.is_open():
		_greet()
	elif _is_refused:
		_is_refused = false
		_open = true
		_next_try_ms = OS.get_ticks_msec() + RETRY_LEAST_MS


# Sends a whole map: 224 x 224 floats, Pa, row by row. Returns the frame's sequence.
func send(pressure_pa):
	return send_window(pressure_pa, 0, 0, Samples.SIDE_PX, Samples.SIDE_PX)


# Sends a rectangle of the map, width x height floats; all other pixels are 0. -1 where it does not fit.
func send_window(samples_pa, column, row, width, height):
	if column < 0 or row < 0 or column + width > Samples.SIDE_PX or row + height > Samples.SIDE_PX or samples_pa.size() != width * height:
		push_error("%d samples are no window of %d x %d at %d, %d" % [samples_pa.size(), width, height, column, row])
		return -1
	var type = _asked.get("sample_type", "f32")
	_step()
	return _put(0, Frame.encode(samples_pa, column, row, width, height, type, _asked.get("pressure_scale_pa"), _sequence, _stamp(), deadline_us))


# Sends where the objects of the hello are in a finger's frame: rows of seven, `row_of` of frames.gd. `net`: [x, y, z, N],
# a net force to be met. Returns the frame's sequence; -1 where there is no such frame.
func send_poses(rows, finger = 0, net = null):
	if rows.size() > OBJECTS_MAX or not _is_finger(finger):
		return -1
	_step()
	var height = rows.size() + (0 if net == null else 1)
	return _put(finger, Frame.encode_rows(Frame.KIND_OBJECTS, Touch.poses(rows, net), Touch.ROW_LEN, height, finger, _sequence, _stamp(), deadline_us))


# Sends how deep the undeformed skin lies in things, mm, negative in air: at the atlas' vertices, or 224 x 224.
func send_gaps(depth_mm, finger = 0, net = null):
	if depth_mm.size() > Samples.MAP_LEN or not _is_finger(finger):
		return -1
	_step()
	var is_map = depth_mm.size() == Samples.MAP_LEN
	var width = Samples.SIDE_PX if is_map else depth_mm.size()
	var height = Samples.SIDE_PX if is_map else 1
	return _put(finger, Frame.encode_rows(Frame.KIND_GAPS, Touch.gaps(depth_mm, net), width, height, finger, _sequence, _stamp(), deadline_us))


# Sends that tracking of a finger is lost. Better than an old pose, or one of zeros: the answer is zero, no unit fires, and nothing
# bursts when tracking comes back.
func send_not_tracked(finger = 0):
	if not _is_finger(finger):
		return -1
	_step()
	return _put(finger, Frame.encode_not_tracked(finger, _sequence, _stamp(), deadline_us))


func _is_finger(finger):
	if finger < 0 or finger >= FINGERS_MAX:
		push_error("there is no finger %d; a session has 10 at most" % finger)
		return false
	return true


func _step():
	_sequence = (_sequence + 1) & 0xffffffff


func _stamp():
	return client_time_us if client_time_us > 0 else OS.get_ticks_usec()


func _put(finger, frame):
	var own = _sequence
	if _waiting.has(finger):
		_end_one(finger, "superseded")
	_waiting[finger] = [frame, own]
	_born_ms[own] = OS.get_ticks_msec()
	_flush()
	return own


# The map of an answer with status ok: 224 x 224 floats. f32 is fast; other types take a loop over the window.
func map_of(answer):
	return Frame.map_of(answer)


# SED of an answer, J/m3: the map, or the values at the vertices; null, and an error, where it carries neither.
func sed_of(answer):
	return Frame.sed_of(answer)


# Firing rates of an answer, Hz, where SED is; null, and an error, without the effect `afferents`.
func rates_hz_of(answer):
	return Frame.rates_hz_of(answer)


# The window of an answer as a picture for a texture, without a loop: f32 (red in J/m3), f16 or u8 (red 1 is 255 x answer.scale).
func image_of(answer):
	return Frame.image_of(answer)


# Moves bytes; the node does so every frame. Call it oftener for answers between frames.
func poll():
	if not _open:
		return
	var now = OS.get_ticks_msec()
	_expire(now - timeout_ms)
	if _link == null:
		if now >= _next_try_ms and not _is_refused:
			_connect()
		return
	if _link.poll():
		_greet()
	_receive()
	if _link != null and _move != null:
		_follow(now)
	if _link == null:
		return
	if _link.has_ended or (server_ready == null and now > _gives_up_ms):
		_lost()
		return
	_flush()


func _receive():
	while _link != null:
		var message = _link.next()
		if message == null:
			return
		if message is String:
			_text(JSON.parse(message).result)
		else:
			_binary(message)


# Goes on over another connection once that is ready; nothing is on its way then.
func _follow(now):
	var agreed = _move.poll(now)
	var why = _move.take_reason()
	if why != "":
		var words = "the service asked the session to move, and did not say what it remembers (%s): it goes on over its old connection, and starts anew when that ends" % why
		_warn(words, words)
	if _move.is_seal_due() and server_ready != null:
		_link.send_text(Move.SEAL)
		_move.hold(now)
	if agreed == null:
		return
	_link.close()
	_link = _move.link
	_move = null
	connections += 1
	_begin(agreed)


func _connect():
	_drop()
	_link = Link.new()
	_is_first_ready = true
	_gives_up_ms = OS.get_ticks_msec() + ATTEMPT_MS
	if not _link.open(_address()):
		_lost()


func _address():
	var address = Address.session(Address.parse(url))
	var clean = Address.stripped(token)
	return address if clean == "" else address + "?access_token=" + clean.percent_encode()


# Whether address or token can be none; `refused` then says why.
func _fault():
	var fault = Address.parse(url).fault
	var code = "bad_address"
	if fault == "" and not Address.is_token(Address.stripped(token)):
		code = "bad_token"
		fault = "the token holds a blank, a line end or a character that no token has"
	if fault == "":
		return false
	_open = false
	push_error("papilla: " + fault)
	emit_signal("refused", {"type": "error", "code": code, "message": fault, "field": null, "closes": false})
	return true


func _words():
	var message = _asked.duplicate(true)
	message["type"] = "hello"
	message["version"] = Frame.VERSION
	message["reconnect"] = true
	return message


func _greet():
	_link.send_text(Compat.json_text(_words()))
	_gives_up_ms = OS.get_ticks_msec() + ATTEMPT_MS


func _drop():
	server_ready = null
	_before = null
	if _move != null:
		_move.close()
		_move = null
	if _link == null:
		return
	var old = _link
	_link = null
	old.close()


func _lost():
	_drop()
	_lose_all()
	_next_try_ms = OS.get_ticks_msec() + RETRY_LEAST_MS + randi() % (RETRY_MOST_MS - RETRY_LEAST_MS)


# Ends the frames that were handed over before: they are lost.
func _expire(born_ms):
	var has_left = false
	var any = false
	for sequence in _born_ms.keys():
		if _born_ms.get(sequence, born_ms + 1) > born_ms:
			continue
		any = true
		if _outstanding.has(sequence):
			has_left = true
			var finger = _outstanding[sequence]
			_outstanding.erase(sequence)
			_tell({"status": "lost", "sequence": sequence, "finger": finger})
			continue
		for finger in _waiting.keys():
			if _waiting[finger][1] == sequence:
				_end_one(finger, "lost")
	if any:
		_warn("timeout", "no answer within %d ms; such frames are lost" % timeout_ms)
	# A server that stopped, or a network that is gone: nothing more will come of this connection.
	if has_left:
		_lost()


# What went out on a lost connection is never answered.
func _lose_all():
	var lost = _outstanding
	_outstanding = {}
	for sequence in lost:
		_tell({"status": "lost", "sequence": sequence, "finger": lost[sequence]})


func _end_waiting(status):
	for finger in _waiting.keys():
		_end_one(finger, status)


func _end_one(finger, status):
	var sequence = _waiting[finger][1]
	_waiting.erase(finger)
	superseded_by_client += int(status == "superseded")
	_tell({"status": status, "sequence": sequence, "finger": finger})


func _flush():
	if _move != null and _move.holds():
		return
	for finger in _waiting.keys():
		if server_ready == null or not _waiting.has(finger) or _outstanding.values().count(finger) >= in_flight_max:
			continue
		var frame = _waiting[finger][0]
		_outstanding[_waiting[finger][1]] = finger
		_waiting.erase(finger)
		sent += 1
		if not _link.send_bytes(frame):
			_lost()
			return


func _begin(agreed):
	server_ready = agreed
	_question(agreed)
	emit_signal("session_ready", server_ready)
	_flush()


func _text(message):
	if message.type == "ready":
		_older_ready = _before.server_ready if _before != null else null
		_before = null
		connections += int(_is_first_ready)
		_is_first_ready = false
		_begin(message)
	elif message.type == "reconnect":
		if _move == null:
			_move = Move.new(_address())
		_move.begin()
	elif message.get("sequence") != null:
		var sequence = int(message.sequence)
		if _outstanding.has(sequence):
			var finger = _outstanding[sequence]
			_outstanding.erase(sequence)
			_warn("error", "a frame was refused: " + message.message)
			_tell({"status": "error", "sequence": sequence, "finger": finger, "problem": message})
			_flush()
	elif _move == null or not _move.takes_refusal(message):
		_on_refusal(message)
		if _is_refused:
			_warn("refused", "the session was refused: " + message.message)
		emit_signal("refused", message)


# A refused renewal leaves the old terms; a refused first hello ends it, unless the reason passes by itself.
func _on_refusal(problem):
	if server_ready != null or problem.closes or PASSING.has(problem.code):
		return
	if _before != null:
		_asked = _before.asked
		server_ready = _before.server_ready
		_before = null
		return
	_is_refused = true
	_drop()


func _binary(packet):
	if Move.is_sealed(packet):
		if _move != null:
			_move.resume(packet, _words(), OS.get_ticks_msec())
		return
	if packet.size() < Frame.HEADER_BYTES:
		push_error("an answer of %d bytes has no header" % packet.size())
		return
	var answer = Frame.read_header(packet)
	if not _outstanding.has(answer.sequence):
		return
	_outstanding.erase(answer.sequence)
	answer.round_trip_us = OS.get_ticks_usec() - answer.client_time_us
	var is_older = _older_ready != null and answer.sequence < _renewed_from
	if answer.status == "ok":
		Frame.read_sections(answer, packet, _older_ready.sections if is_older else server_ready.sections)
	if not is_older:
		_older_ready = null
	_flush()
	if answer.status == "ok" and answer.out_of_range:
		_warn("out_of_range", "pressure is beyond what the tier knows; such answers are flagged")
	if answer.status == "ok" and answer.coarse_clock:
		_warn("coarse_clock", "the times of the frames have steps above 20 ms, stand still, or are in ms or ns in place of us; rates, spikes and creep in such answers are wrong, and flagged coarse_clock")
	_tell(answer)


# Says once what a scene that looks at maps alone would not see.
func _warn(kind, words):
	if not _warned.has(kind) and _warned.size() < 100:
		_warned[kind] = true
		warnings.append(words)
		push_warning("papilla: " + words)


# What the server asks, and a budget that it cannot meet.
func _question(agreed):
	for each in agreed.get("warnings", []):
		var asked = each.member + ": " + each.question
		_warn(asked, asked)
	if agreed.get("meets_budget") != false:
		return
	var budget = int(agreed.budget_us)
	var words = "a frame of tier %s takes some %d us, and budget_us is %d, so that frames may be late" % [agreed.tier, int(agreed.predicted_latency_us), budget]
	if budget < 100:
		words += "; it counts microseconds: were %d ms meant?" % budget
	_warn(words, words)


func _tell(answer):
	_born_ms.erase(answer.sequence)
	emit_signal("answered", answer)
	if answer.status == "ok" and answer.has_map:
		emit_signal("map_received", answer)
	if answer.has("touch"):
		emit_signal("touched", answer)
