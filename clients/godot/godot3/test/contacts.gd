# Maps of contacts beside the formula, pixel by pixel: PAPILLA_ATLAS names the file. Prints how long they took.
extends SceneTree

const Atlas = preload("res://addons/papilla/atlas.gd")
# What rounding may differ by at the rim, where the root is steep, of the greatest pressure.
const ROUNDING = 1e-4

var atlas
var compared = 0
var failures = 0


func _initialize():
	var file = File.new()
	file.open(OS.get_environment("PAPILLA_ATLAS"), File.READ)
	atlas = Atlas.new(file.get_as_text())
	var pad = [11.2, 0, -6.6]
	for contacts in [
		[{"at_mm": pad, "force_n": 0.005}],
		[{"at_mm": pad, "force_n": 0.5, "radius_mm": 0.001}],
		[{"at_mm": pad, "force_n": 1.0}],
		[{"at_mm": pad, "force_n": 10.0}],
		[{"at_mm": [1.0, 0.3, -7.0], "force_n": 10.0}],
		[{"at_mm": pad, "force_n": 2.0}, {"at_mm": [14.0, 1.0, -6.0], "force_n": 1.0}, {"at_mm": [0, 0, 90], "force_n": 1.0}],
	]:
		_compare(contacts)
	if atlas.force_n(atlas.contact_map([])) != 0:
		_fail("no contact presses")
	# A script that breaks down goes on with its caller.
	quit(0 if compared == 6 and failures == 0 else 1)


func _compare(contacts):
	var least_us = 1e9
	var map
	for _run in 20:
		var begun = OS.get_ticks_usec()
		map = atlas.contact_map(contacts)
		least_us = min(least_us, OS.get_ticks_usec() - begun)
	var due = Atlas.zeros()
	for contact in contacts:
		due = _add(due, contact)
	var top = 0.0
	var apart = 0.0
	for i in due.size():
		top = max(top, due[i])
		apart = max(apart, abs(due[i] - map[i]))
	print("%s: %d us, greatest difference %s" % [contacts, least_us, apart / top])
	compared += 1
	if not (top > 0 and apart <= ROUNDING * top and map.size() == due.size()):
		_fail("not the formula's map")


func _add(map, contact):
	var at = Vector3(contact.at_mm[0], contact.at_mm[1], contact.at_mm[2])
	var places = []
	var nearest = -1
	var within = Atlas.REACH_MM
	for n in atlas.pixels.size():
		places.append(Vector3(atlas.places_mm[3 * n], atlas.places_mm[3 * n + 1], atlas.places_mm[3 * n + 2]))
		var distance = at.distance_to(places[n])
		if distance < within or (distance == within and (nearest < 0 or atlas.pixels[n] < atlas.pixels[nearest])):
			within = distance
			nearest = n
	if nearest < 0:
		return map
	var radius_mm = contact.get("radius_mm", Atlas.RADIUS_AT_1_N_MM * pow(contact.force_n, 1.0 / 3.0))
	var parts = []
	var total = 0.0
	for n in places.size():
		var part = 1.0 - places[nearest].distance_squared_to(places[n]) / (radius_mm * radius_mm)
		parts.append(sqrt(max(part, 0.0)))
		total += parts[n] * atlas.areas_mm2[n]
	for n in places.size():
		map[atlas.pixels[n]] += 1e6 * contact.force_n / total * parts[n]
	return map


func _fail(why):
	print("FAILED: ", why)
	failures += 1
