# What a haptic device takes of a session: intensities from 0 to 1, at most `max_hz` times a second, and 0 when answers stop.
# `feed` every answer of `answered`, `poll` each frame, and hand what it gives to the device:
#
#   var motor = Device.new()
#   func _on_answered(answer): motor.feed(answer)
#   func _process(_delta):
#   	var command = motor.poll()
#   	if command != null: Input.start_joy_vibration(0, command.amplitude, command.amplitude, command.duration_s)
extends Reference

# What is felt: "force", the size of the force on the finger; of pressure maps the effect `summary` has it. "actuators", an
# intensity for each actuator of that effect. "spikes", the mean firing rate of units of the effect of this name; most units lie
# outside of a contact, so that a few Hz are much. Override `read` for something else.
var source = "force"
# What intensity 1 stands for: N, the `intensity_max` of actuators, or Hz.
var full = 1.0
# A force up to here is not felt, N.
var threshold_n = 0.0
# For spikes, `units` of the session's ready, and the classes that count: rapidly adapting and Pacinian ones fire at changes.
var units = []
var classes = ["ra", "pc"]
var fingers = 1
# Commands a second that the device takes.
var max_hz = 90.0
# What an answer said is held for so long, s, and then fades to 0 within `fade_s`.
var hold_s = 0.05
var fade_s = 0.05

# After a longer pause the service computes its last 50 ms.
const SPIKES_US_MAX = 50000

# By finger.
var _last_us = {}
var _values = {}
var _at_s = {}
var _next_s = -INF
var _is_silent = true


# Intensities of an answer, from 0 to 1, as an Array; null: it says nothing about them.
func read(answer):
	if source == "actuators":
		return _actuators(answer)
	if source == "spikes":
		return _spikes(answer)
	if answer.has("touch"):
		return [_share(answer.touch.force_n.length())]
	if answer.has("summary"):
		return [_share(answer.summary[0])]
	if answer.no_contact:
		return [_share(0.0)]
	push_error("papilla: the answer carries no force: send objects or gaps, or name the effect 'summary' in the hello")
	return null


# Seconds that only rise.
func now_s():
	return OS.get_ticks_usec() * 1e-6


# What is wrong with the settings; "" where nothing is.
func fault():
	for name in ["full", "max_hz", "hold_s", "fade_s"]:
		if not get(name) > (threshold_n if name == "full" and source == "force" else 0.0) or is_inf(get(name)):
			return "%s is %s" % [name, get(name)]
	if source == "spikes" and _count() == 0:
		return "none of %d units is of the classes %s: set `units` of the session's ready" % [units.size(), classes]
	return ""


# Takes the next answer, of any finger. One without a value (late, lost, refused) counts as none. False, and an error, where the
# device has no such finger, or its settings are none.
func feed(answer):
	var wrong = fault()
	if wrong == "" and (answer.finger < 0 or answer.finger >= fingers):
		wrong = "finger %d is none of the device, which has %d" % [answer.finger, fingers]
	if wrong != "":
		push_error("papilla: device: " + wrong)
		return false
	if answer.status != "ok":
		return true
	if answer.not_tracked:
		_at_s.erase(answer.finger)
		return true
	var found = read(answer)
	if found == null:
		return true
	var row = []
	for each in found:
		# What is no number drives no motor: the finger fades as without an answer.
		if is_nan(each) or is_inf(each):
			return true
		row.append(clamp(each, 0.0, 1.0))
	_values[answer.finger] = row
	_at_s[answer.finger] = now_s()
	return true


# The intensities now: an Array for each finger.
func levels():
	var now = now_s()
	var found = []
	for finger in fingers:
		var left = 0.0
		if _at_s.has(finger):
			left = clamp(1.0 - (now - _at_s[finger] - hold_s) / fade_s, 0.0, 1.0)
		var row = []
		for each in _values.get(finger, [0.0]):
			row.append(each * left)
		found.append(row)
	return found


# What is due: {levels, amplitude, duration_s}, the amplitude being the greatest level; null before the device takes another
# command, or as long as it is silent anyway.
func poll():
	var now = now_s()
	if now < _next_s or fault() != "":
		return null
	var command = _command(hold_s + fade_s)
	var is_silent = command.amplitude == 0.0
	if is_silent and _is_silent:
		return null
	_is_silent = is_silent
	_next_s = now + 1.0 / max_hz
	return command


# All at 0 from now on, whatever the rate: for the end of a program, or a lost device.
func stop():
	_at_s.clear()
	_is_silent = true
	return _command(0.0)


func _command(duration_s):
	var found = levels()
	var most = 0.0
	for finger in found:
		for level in finger:
			most = max(most, level)
	return {"levels": found, "amplitude": most, "duration_s": duration_s}


func _share(force_n):
	return (force_n - threshold_n) / (full - threshold_n)


# How many units count.
func _count():
	var count = 0
	for unit in units:
		count += int(classes.has(unit["class"]))
	return count


func _spikes(answer):
	if not answer.has("spikes"):
		push_error("papilla: the answer carries no spikes: name that effect in the hello")
		return null
	var passed_us = answer.client_time_us - _last_us.get(answer.finger, answer.client_time_us)
	_last_us[answer.finger] = answer.client_time_us
	if passed_us <= 0:
		return null
	var fired = 0
	for spike in answer.spikes:
		fired += int(spike.unit < units.size() and classes.has(units[spike.unit]["class"]))
	return [fired / (_count() * 1e-6 * min(passed_us, SPIKES_US_MAX) * full)]


func _actuators(answer):
	if not answer.has("actuators"):
		push_error("papilla: the answer carries no actuators: name that effect in the hello")
		return null
	var found = []
	for value in answer.actuators:
		found.append(value / full)
	return found
