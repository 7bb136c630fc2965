# Round trips of whole f32 maps, one JSON line: rate and duration from RATE_HZ and DURATION_S. From the instant at which a frame was
# due to the answer in the user's hands; the node is polled without pause, as a thread of a game would.
extends SceneTree

const Session = preload("res://addons/papilla/session.gd")
const Atlas = preload("res://addons/papilla/atlas.gd")
const WARM = 50

var due = {}
var took = []
var missing = 0


func _init():
	var rate_hz = float(OS.get_environment("RATE_HZ"))
	var count = int(float(OS.get_environment("DURATION_S")) * rate_hz) + WARM
	var session = Session.new()
	session.url = OS.get_environment("PAPILLA_URL")
	session.hello = preload("res://addons/papilla/hello.gd").new().with({"tier": "half-space"})
	session.connect("answered", self, "_on_answered")
	session.open()
	while session.server_ready == null:
		session.poll()
		OS.delay_msec(1)
	var maps = []
	for k in 8:
		maps.append(_map(k * PI / 4))
	var start = OS.get_ticks_usec() + 10000
	var next = 0
	while took.size() + missing < count:
		var at = start + int(next * 1e6 / rate_hz)
		var now = OS.get_ticks_usec()
		if next < count and now >= at:
			due[session._sequence + 1] = at
			session.send(maps[next % maps.size()])
			next += 1
		elif next >= count or at - now > 300:
			OS.delay_usec(100)
		session.poll()
	session.close()
	session.free()
	var sorted = took.slice(WARM, took.size() - 1)
	sorted.sort()
	print(JSON.print({"client": "godot%d" % Engine.get_version_info().major, "rate_hz": rate_hz, "frames": sorted.size(), "missing": missing,
		"p50_us": sorted[sorted.size() / 2], "p99_us": sorted[int(0.99 * sorted.size())], "max_us": sorted[-1]}))
	quit()


func _on_answered(answer):
	if answer.status != "ok":
		missing += 1
		return
	took.append(OS.get_ticks_usec() - due[answer.sequence])


func _map(angle):
	var map = Atlas.zeros()
	for i in map.size():
		var u = i % 224 + 0.5 - 112 - 20 * cos(angle)
		var v = i / 224 + 0.5 - 112 - 20 * sin(angle)
		map[i] = 15000 * exp(-(u * u + v * v) / 288)
	return map
