# The steps of docs/reference/conformance.md by this client: clients/godot/test runs it
extends SceneTree

const Session = preload("res://addons/papilla/session.gd")
const Address = preload("res://addons/papilla/address.gd")
const Atlas = preload("res://addons/papilla/atlas.gd")
const Http = preload("res://addons/papilla/http.gd")
const Typed = preload("res://test/typed.gd")
const Patterns = preload("res://test/patterns.gd")
const Frames = preload("res://addons/papilla/frames.gd")
# Different maps of a burst.
const DRAWN = 5

var url = OS.get_environment("PAPILLA_URL")
var atlas
var patience_ms
var why = ""
var session
var outcomes = {}
var order = []
var tiers = {}
var reply = null
var connections = 1


func _init():
	var file = File.new()
	file.open(OS.get_environment("PAPILLA_CONFORMANCE"), File.READ)
	var script = JSON.parse(file.get_as_text()).result
	patience_ms = int(script.timeout_s) * 1000
	atlas = Atlas.new(Http.atlas_text(url))
	if atlas.hash_hex != script.atlas_hash:
		print("another atlas: ", atlas.hash_hex)
		quit(1)
		return
	var failed = 0
	for one in script.cases:
		why = ""
		outcomes = {}
		order = []
		connections = 1
		var at = 0
		for step in one.steps:
			at += 1
			call("step_" + step.do, step, step.get("expect", {}))
			if why != "":
				break
		if session != null:
			session.close()
			session.free()
			session = null
		print("ok " + one.name if why == "" else "FAIL %s: step %d: %s" % [one.name, at, why])
		failed += int(why != "")
	quit(1 if failed else 0)


func fail(what):
	if why == "":
		why = what


func same(what, found, due):
	if typeof(found) != typeof(due) and not (typeof(found) in [TYPE_INT, TYPE_REAL] and typeof(due) in [TYPE_INT, TYPE_REAL]) or found != due:
		fail("%s is %s, not %s" % [what, found, due])


func near(what, found, value, tolerance):
	if not abs(found - value) <= tolerance:
		fail("%s is %s, not %s +- %s" % [what, found, value, tolerance])


func all_near(what, found, due):
	if found == null or found.size() != due.size():
		fail("%s is missing" % what)
		return
	for k in due.size():
		near("%s %d" % [what, k], found[k], due[k][0], due[k][1])


# Polls until the method (or its argument) says true.
func wait_for(method, argument = null, patience = 0):
	var end = OS.get_ticks_msec() + (patience if patience > 0 else patience_ms)
	while not call(method, argument):
		session.poll()
		OS.delay_msec(1)
		if OS.get_ticks_msec() > end:
			fail("%s: not in time" % method)
			return false
	return true


func has_reply(_none):
	return reply != null


func has_outcome(sequence):
	return outcomes.has(sequence)


func has_outcomes(sequences):
	for sequence in sequences:
		if not outcomes.has(sequence):
			return false
	return true


func on_answered(answer):
	if outcomes.has(answer.sequence):
		fail("frame %d has two outcomes" % answer.sequence)
	outcomes[answer.sequence] = answer
	order.append(answer.sequence)


func on_session_ready(server_ready):
	reply = server_ready
	tiers[int(server_ready.tier_number)] = server_ready.tier


func on_refused(problem):
	reply = problem


func step_address(step, expect):
	var address = Address.parse(step.address)
	if expect.get("status") != "error":
		same(step.address, address.fault, "")
		if address.fault == "":
			same(step.address, Address.session(address), expect.session)
			same(step.address, Address.http(address, "/v1/atlas"), expect.http)
		return
	if address.fault.find(expect.says) < 0:
		fail("%s: '%s' does not say %s" % [step.address, address.fault, expect.says])
	same("code over HTTP", Http.post_pressure(step.address, PoolRealArray()).problem.code, expect.code)
	refused_with(step.address, "", expect.code)


func step_token(step, expect):
	var clean = Address.stripped(step.token)
	if expect.get("status") != "error":
		same("the token", clean if Address.is_token(clean) else "refused", expect.token)
		return
	refused_with(url, step.token, expect.code)


func refused_with(address, token, code):
	reply = {}
	var own = Session.new()
	own.url = address
	own.token = token
	own.connect("refused", self, "on_refused")
	own.open()
	same("code", reply.get("code"), code)
	own.close()
	own.free()
	reply = null


func step_hello(step, expect):
	reply = null
	var typed = Typed.new()
	var hello = typed.hello_of(step.hello)
	if typed.fault != "":
		fail(typed.fault)
		return
	if session == null:
		session = Session.new()
		session.url = url
		session.hello = hello
		session.timeout_ms = patience_ms
		session.connect("answered", self, "on_answered")
		session.connect("session_ready", self, "on_session_ready")
		session.connect("refused", self, "on_refused")
		session.open()
	else:
		session.renew(hello)
	if not wait_for("has_reply"):
		return
	if expect.get("status") == "error":
		same("reply", reply.type, "error")
		for member in ["code", "field"]:
			if expect.has(member):
				same(member, reply.get(member), expect[member])
		return
	if reply.type != "ready":
		fail("%s: %s" % [reply.code, reply.message])
		return
	for words in expect.get("warnings", []):
		told(words)
	var due = expect.get("ready", {})
	for member in due:
		same("ready." + member, to_json(reply[member]), to_json(due[member]))


func step_frame(step, expect):
	var map = Patterns.pattern(step.pressure, 1.0)
	session.deadline_us = int(step.get("deadline_us", 0))
	for attempt in int(step.get("attempts", 1)):
		session.client_time_us = int(step.get("client_time_us", 0))
		var before = OS.get_ticks_usec()
		var sequence
		if step.has("window"):
			var w = step.window
			sequence = session.send_window(Patterns.cut(map, w), int(w[0]), int(w[1]), int(w[2]), int(w[3]))
		else:
			sequence = session.send(map)
		var after = OS.get_ticks_usec()
		if sequence < 0:
			check(expect, {"status": "error", "problem": {"code": "wrong_shape"}})
			return
		if not wait_for("has_outcome", sequence):
			return
		var outcome = outcomes[sequence]
		if outcome.status == "lost":
			continue
		if outcome.has("client_time_us"):
			var stamp = outcome.client_time_us
			if stamp != session.client_time_us if session.client_time_us > 0 else (stamp < before or stamp > after):
				fail("client time %d" % stamp)
		check(expect, outcome)
		return
	fail("the frame was lost")


func check(expect, outcome):
	same("status (%s)" % outcome.get("problem"), outcome.status, expect.get("status", "ok"))
	if expect.has("code"):
		same("code", outcome.problem.code, expect.code)
	if expect.has("field") and outcome.problem.has("field"):
		same("field", outcome.problem.field, expect.field)
	if outcome.status != "ok" or why != "":
		return
	if outcome.infer_us + outcome.queue_us > outcome.total_us:
		fail("times do not add up")
	if expect.has("flags"):
		var flags = []
		for flag in ["out_of_range", "no_contact", "unfamiliar", "cut_off", "not_tracked", "coarse_clock"]:
			if outcome[flag]:
				flags.append(flag)
		same("flags", str(flags), str(expect.flags))
	if expect.has("tier"):
		same("tier", tiers[outcome.tier_number], expect.tier)
	if expect.has("window"):
		var found = [outcome.column, outcome.row, outcome.width, outcome.height]
		for k in 4:
			same("window", found[k], expect.window[k])
	if expect.get("map") == false:
		same("samples", outcome.samples.size(), 0)
	for section in ["summary", "points", "actuators"]:
		if expect.has(section):
			all_near(section, outcome.get(section), expect[section])
	if expect.has("point_rates"):
		all_near("point_rates", outcome.get("point_rates_hz"), expect.point_rates)
	same("rates", outcome.has("rates_hz"), expect.has("rates"))
	if expect.has("rates"):
		check_map(expect.rates, session.rates_hz_of(outcome))
	if expect.has("pixels") or expect.has("sum") or expect.has("max"):
		check_map(expect, session.map_of(outcome))
	check_errors(expect, outcome)


# How wrong the answer says that it may be: what is null is infinite. Without the section there is no member.
func check_errors(expect, outcome):
	if not expect.has("error_estimate"):
		return
	var found = outcome.get("error_estimate", {})
	var due = expect.error_estimate
	var names = ["sed_median", "sed_p90", "force_median", "force_p90"]
	for k in names.size():
		var value = found.get(names[k], INF)
		if due[k] != null:
			near(names[k], value, due[k][0], due[k][1])
		elif value != INF:
			fail("%s is %s, not infinite" % [names[k], value])


func check_map(expect, map):
	for pixel in expect.get("pixels", []):
		near("pixel %s" % [pixel], map[int(pixel[0]) * 224 + int(pixel[1])], pixel[2], pixel[3])
	var sum = 0.0
	var most = 0.0
	for value in map:
		sum += value
		most = max(most, value)
	if expect.has("sum"):
		near("sum", sum, expect.sum[0], expect.sum[1])
	if expect.has("max"):
		near("max", most, expect.max[0], expect.max[1])


func steer(what):
	var answer = Http.fetch(OS.get_environment("PAPILLA_CONTROL"), what, HTTPClient.METHOD_POST, ["Content-Length: 0"], PoolByteArray(), patience_ms)
	if answer.status != 200:
		fail("the runner does not " + what)


func step_burst(step, expect):
	var before = session.superseded_by_client
	var paused = step.get("paused", false)
	var sequences = []
	# Drawn before, for drawing a map takes longer here than a fast tier needs to render it. A few, sent over and over, the whole one
	# last: a busy machine takes minutes for hundreds, and the service ends a session that is silent for one.
	var drawn = []
	for k in DRAWN:
		drawn.append(Patterns.pattern(step.pressure, (k + 1) / float(DRAWN)))
	var maps = []
	for k in int(step.count):
		maps.append(drawn[DRAWN - 1 - (int(step.count) - 1 - k) % DRAWN])
	if paused:
		steer("pause")
	for map in maps:
		sequences.append(session.send(map))
		session.poll()
		OS.delay_msec(int(step.get("gap_ms", 0)))
	if paused:
		steer("resume")
	if not wait_for("has_outcomes", sequences):
		return
	var superseded = 0
	for sequence in sequences:
		var status = outcomes[sequence].status
		superseded += int(status == "superseded")
		if not status in ["ok", "superseded"]:
			fail("a frame was " + status)
	var last = -1
	for sequence in order:
		if outcomes[sequence].status == "ok":
			if sequence < last:
				fail("answers came out of order")
			last = sequence
	check(expect.get("newest", {}), outcomes[sequences[-1]])
	if superseded < expect.get("superseded", 0):
		fail("%d superseded" % superseded)
	if session.superseded_by_client - before < expect.get("superseded_by_client", 0):
		fail("%d superseded by the client" % (session.superseded_by_client - before))


func step_reconnect(step, _expect):
	reply = null
	steer("restart")
	wait_for("has_reply", null, int(step.within_s * 1000))


func told(words):
	for each in session.warnings:
		if each.find(words) >= 0:
			return
	fail("nobody was told: " + words)


# The server stops, or dies, while frames wait for it.
func step_silence(step, _expect):
	var map = Patterns.pattern(step.pressure, 1.0)
	if not wait_for("has_outcome", session.send(map)):
		return
	session.timeout_ms = int(step.timeout_ms)
	steer(step.how)
	var sequences = []
	for _k in int(step.count):
		sequences.append(session.send(map))
		session.poll()
		OS.delay_msec(50)
	if not wait_for("has_outcomes", sequences):
		return
	for sequence in sequences:
		var status = outcomes[sequence].status
		if status != "lost" and (status != "superseded" or sequence == sequences[-1]):
			fail("a frame is " + status)
	told("no answer within")
	reply = null
	steer("resume" if step.how == "pause" else "start")
	session.timeout_ms = patience_ms
	wait_for("has_reply", null, int(step.within_s * 1000))


# It may have moved between the steps.
func step_move(step, _expect):
	if wait_for("has_moved", connections, int(step.within_s * 1000)):
		connections = session.connections


func has_moved(before):
	return session.connections > before


# It was asked to move and could not, and says why.
func step_stay(step, _expect):
	if wait_for("has_said", step.says, int(step.within_s * 1000)):
		same("connections", session.connections, connections)


func has_said(words):
	for warning in session.warnings:
		if warning.find(words) >= 0:
			return true
	return false


func step_http(step, expect):
	var answer = Http.post_pressure(url, Patterns.pattern(step.pressure, 1.0), step.tier)
	if answer.has("problem"):
		check(expect, {"status": "error", "problem": answer.problem})
		return
	if expect.has("tier"):
		same("tier", answer.tier, expect.tier)
	same("status", "ok", expect.get("status", "ok"))
	check_map(expect, answer.map)


func step_rasterise(step, expect):
	var g = step.vertices.gaussian_mm
	var values = PoolRealArray()
	for i in atlas.vertex_count():
		var d2 = 0.0
		for k in 3:
			d2 += pow(atlas.skin_mm[3 * i + k] - g[k], 2)
		values.append(g[4] * exp(-d2 / (2 * g[3] * g[3])))
	check_map(expect, atlas.pressure_map(values))


func transform_of(row):
	return Transform(Basis(Quat(row[3], row[4], row[5], row[6])), Vector3(row[0], row[1], row[2]))


# The row is the one due: its place within some hundredths of a mm, as Godot's floats hold a world, its quaternion up to the sign.
func check_row(made, row):
	if made == null:
		fail("no row")
		return
	var dot = 0.0
	for k in 4:
		dot += made[3 + k] * row[3 + k]
	for k in 3:
		near("origin", made[k], row[k], 1e-2)
	near("turn", abs(dot), 1.0, 1e-5)


func step_touch(step, expect):
	if step.poses == null:
		check_touch(step, expect, session.send_not_tracked(int(step.get("finger", 0))))
		return
	if step.has("engines"):
		step_placed(step, expect)
	else:
		check_touch(step, expect, session.send_poses(step.poses, int(step.get("finger", 0)), step.get("net")))


# The objects where the step says that Godot has them.
func step_placed(step, expect):
	var said = step.engines.godot
	var finger = transform_of(said.finger)
	var tracked = Frames.finger_of_joints(transform_of(said.joints.distal), transform_of(said.joints.tip), Vector3(0, 0, -1), said.joints.inside_mm)
	var rows = []
	for k in step.poses.size():
		rows.append(Frames.row_of(finger, transform_of(said.objects[k])))
		check_row(rows[k], step.poses[k])
		check_row(Frames.row_of(tracked, transform_of(said.objects[k])), step.poses[k])
	var sequence = session.send_poses(rows)
	check_touch(step, expect, sequence)
	if why != "":
		return
	var felt = Frames.felt(finger, outcomes[sequence].touch)
	for member in expect.engines.godot:
		var three = felt[member]
		all_near(member, [three.x, three.y, three.z], expect.engines.godot[member])


func step_gaps(step, expect):
	var ball = step.sphere
	var depth_mm = PoolRealArray()
	for i in atlas.vertex_count():
		var d2 = 0.0
		for k in 3:
			d2 += pow(atlas.skin_mm[3 * i + k] - ball[k], 2)
		depth_mm.append(ball[3] - sqrt(d2))
	for i in atlas.vertex_count() if step.has("velocity") else 0:
		for k in 3:
			depth_mm.append(step.velocity[k])
	check_touch(step, expect, session.send_gaps(depth_mm, int(step.get("finger", 0)), step.get("net")))


func check_touch(step, expect, sequence):
	if not wait_for("has_outcome", sequence):
		return
	var outcome = outcomes[sequence]
	same("status (%s)" % outcome.get("problem"), outcome.status, expect.get("status", "ok"))
	same("finger", outcome.finger, int(step.get("finger", 0)))
	for member in ["code", "field"]:
		if expect.has(member):
			same(member, outcome.problem[member], expect[member])
	if outcome.status != "ok" or why != "":
		return
	var t = outcome.touch
	var found = []
	for three in [t.force_n, t.torque_n_mm]:
		found += [three.x, three.y, three.z]
	found += [t.area_mm2, t.centre_mm.x, t.centre_mm.y, t.centre_mm.z, t.penetration_mm]
	found += [t.stiffness_n_per_mm, t.travel_mm, t.pressure_max_pa, t.share]
	all_near("touch", found, expect.touch)
	if expect.has("pressure_sum"):
		var sum = 0.0
		for value in outcome.pressure:
			sum += value
		near("pressure", sum, expect.pressure_sum[0], expect.pressure_sum[1])
	same("no_contact", outcome.no_contact, expect.flags.has("no_contact"))
	same("not_tracked", outcome.not_tracked, expect.flags.has("not_tracked"))
	if outcome.out_of_range or outcome.unsettled:
		fail("out of range or unsettled")
	check_errors(expect, outcome)


func step_contacts(step, expect):
	var map = atlas.contact_map(step.contacts)
	check_map(expect, map)
	if expect.has("force_n"):
		near("force", atlas.force_n(map), expect.force_n[0], expect.force_n[1])
