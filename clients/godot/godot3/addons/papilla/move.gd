# A session's way to another connection when the service asks for it (docs/reference/protocol-moving.md): the connection is
# opened while frames go on over the old one; then they wait until the old one has said what the service remembers,
# sealed, and the new one is ready. Where a step fails, the old connection goes on, and it is tried again; where the old one
# does not say what the service remembers, that is the end of it until the service asks again.
extends Reference

const Compat = preload("compat.gd")
const Link = preload("link.gd")
const PATIENCE_MS = 5000
const RETRY_MS = 200
const SEAL = "{\"type\": \"seal\"}"

enum { PAUSE, DIALLING, SEAL_DUE, HELD, RESUMING, STAYS }

# The other connection; null: none just now.
var link = null

var _address
var _stage = PAUSE
# The end of the stage.
var _until_ms = 0
# Seals that were asked for and have not come: one that comes after its patience is not the last one's.
var _asked = 0
# Why the session stays where it is; "": it does not.
var _why = ""


func _init(address):
	_address = address


# The service asks to move.
func begin():
	if _stage == STAYS:
		_stage = PAUSE
		_why = ""


# Why the session stays, once; "" where there is nothing to tell.
func take_reason():
	var why = _why
	_why = ""
	return why


# Whether frames have to wait.
func holds():
	return _stage == HELD or _stage == RESUMING


func is_seal_due():
	return _stage == SEAL_DUE


# The session has asked the old connection for its seal.
func hold(now):
	_asked += 1
	_enter(HELD, now)


# A sealed state came over the old connection. `hello`: its session's.
func resume(sealed, hello, now):
	_asked -= 1
	if _asked > 0 or _stage != HELD:
		return
	var message = hello.duplicate(true)
	message["resume"] = true
	link.send_text(Compat.json_text(message))
	if link.send_bytes(sealed):
		_enter(RESUMING, now)
	else:
		put_off(now)


# A refusal came over the old connection: whether it is in place of the seal, while nothing else is asked for.
func takes_refusal(problem):
	if _stage != HELD:
		return false
	_asked -= 1
	if _asked <= 0:
		_stay(problem.message)
	return true


# The old connection does not say what the service remembers: the session goes on over it.
func _stay(why):
	_why = why
	_stage = STAYS
	close()


# Lets the old connection go on, and tries again.
func put_off(now):
	_stage = PAUSE
	_until_ms = now + RETRY_MS
	close()


func close():
	if link != null:
		link.close()
		link = null


# Moves bytes. The new session's ready, once; null before.
func poll(now):
	if link == null:
		if _stage != STAYS and now >= _until_ms:
			_dial(now)
		return null
	var begins = link.poll()
	if _stage == HELD and now > _until_ms:
		_stay("nothing came within %d s" % (PATIENCE_MS / 1000.0))
	elif link.has_ended or now > _until_ms:
		put_off(now)
	elif _stage == DIALLING and begins:
		_enter(SEAL_DUE, now)
	elif _stage == RESUMING:
		return _ready_of(link.next(), now)
	return null


func _enter(stage, now):
	_stage = stage
	_until_ms = now + PATIENCE_MS


func _dial(now):
	link = Link.new()
	_enter(DIALLING, now)
	if not link.open(_address):
		put_off(now)


func _ready_of(message, now):
	if message == null:
		return null
	var told = JSON.parse(message).result if message is String else {}
	if told.get("type") == "ready":
		return told
	put_off(now)
	return null


# Whether a message is what a session remembers: it begins with PPS.
static func is_sealed(packet):
	return packet.size() > 3 and packet[0] == 0x50 and packet[1] == 0x50 and packet[2] == 0x53
