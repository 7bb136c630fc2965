# The script of devices, clients/conformance/devices.json, as every client runs it, on a clock of its own: PAPILLA_DEVICES names
# the file.
extends SceneTree

const Device = preload("res://addons/papilla/device.gd")
const Frame = preload("res://addons/papilla/frame.gd")


class Clocked:
	extends "res://addons/papilla/device.gd"
	var at_s = 0.0

	func now_s():
		return at_s


var tolerance
var failures = 0
var cases = 0
var name = ""


func _initialize():
	var file = File.new()
	file.open(OS.get_environment("PAPILLA_DEVICES"), File.READ)
	var script = JSON.parse(file.get_as_text()).result
	tolerance = script.tolerance
	for one in script.cases:
		name = one.name
		_run(one)
		cases += 1
	_read_spikes()
	if Device.new().fault() != "":
		_fail("a device as it is made has a fault")
	print("%d checks failed" % failures if failures else "devices: %d cases" % cases)
	# A script that breaks down goes on with its caller.
	quit(0 if cases >= 21 and failures == 0 else 1)


# Two spikes behind their counts, the second at the time of the frame; what follows is of no spike.
func _read_spikes():
	name = "spikes"
	var section = StreamPeerBuffer.new()
	section.big_endian = false
	for count in [9, 2]:
		section.put_u32(count)
	for number in [4, 800, 2, 0, 7, 7]:
		section.put_u16(number)
	var answer = {"client_time_us": 7000000, "sample_type": 0, "scale": 1.0}
	Frame.read_sections(answer, section.data_array, [{"name": "spikes", "offset": 0, "bytes": 20}])
	if answer.spikes_total != 9 or answer.spikes.size() != 2:
		_fail("%s" % answer)
		return
	_near("unit", answer.spikes[0].unit, 4)
	_near("time", answer.spikes[0].time_us, 6999200)
	_near("unit", answer.spikes[1].unit, 2)
	_near("time", answer.spikes[1].time_us, 7000000)


func _number(said):
	return said if typeof(said) == TYPE_REAL else NAN if said == "nan" else INF


func _device_of(said):
	var device = Clocked.new()
	device.source = "force" if said.has("force") else "actuators" if said.has("actuators") else "spikes"
	if device.source == "spikes":
		device.full = _number(said.spike_rate.full_hz)
		for one in said.spike_rate.units:
			device.units.append({"class": one})
	else:
		device.full = _number(said[device.source].full if device.source == "actuators" else said.force.full_n)
	device.threshold_n = said.get("force", {}).get("threshold_n", 0.0)
	device.fingers = int(said.get("fingers", 1))
	for member in ["max_hz", "hold_s", "fade_s"]:
		if said.has(member):
			device.set(member, said[member])
	return device


func _answer_of(said):
	var answer = {"status": said.get("status", "ok"), "finger": int(said.get("finger", 0))}
	if answer.status != "ok":
		return answer
	answer.no_contact = said.get("no_contact", false)
	answer.not_tracked = said.get("not_tracked", false)
	if said.has("force_n"):
		var n = said.force_n
		answer.touch = {"force_n": Vector3(_number(n[0]), _number(n[1]), _number(n[2]))}
	if said.has("summary_force_n"):
		answer.summary = [said.summary_force_n]
	if said.has("actuators"):
		answer.actuators = said.actuators
	answer.client_time_us = int(said.get("client_time_us", 0))
	if said.has("spikes"):
		answer.spikes = []
		for unit in said.spikes:
			answer.spikes.append({"unit": int(unit), "time_us": answer.client_time_us})
	return answer


func _run(one):
	var device = _device_of(one.device)
	if one.get("refused", false):
		if device.fault() == "":
			_fail("it is taken")
		return
	for step in one.steps:
		device.at_s = step.at_s
		if step.has("poll"):
			_compare(device.poll(), step.poll)
		elif step.has("stop"):
			_compare(device.stop(), step.stop)
		elif device.feed(_answer_of(step.feed)) == step.get("refused", false):
			_fail("fed at %s" % step.at_s)


func _compare(command, due):
	if command == null or due == null:
		if command != due:
			_fail("%s, not %s" % [command, due])
		return
	for finger in due.levels.size():
		var found = command.levels[finger]
		for k in due.levels[finger].size():
			_near("level", found[k] if k < found.size() else 0.0, due.levels[finger][k])
	_near("amplitude", command.amplitude, due.amplitude)
	_near("duration", command.duration_s, due.duration_s)


func _near(what, found, due):
	if not abs(found - due) <= tolerance:
		_fail("%s is %s, not %s" % [what, found, due])


func _fail(why):
	print("FAILED: ", name, ": ", why)
	failures += 1
