# Made of clients/godot/godot3/test/patterns.gd by clients/godot/generate: edit that one.
# The pressure patterns of docs/conformance.md.
extends RefCounted

const Atlas = preload("res://addons/papilla/atlas.gd")
const Samples = preload("res://addons/papilla/samples.gd")


static func cut(map, w):
	var samples = PackedFloat32Array()
	for y in int(w[3]):
		for x in int(w[2]):
			samples.append(map[((int(w[1]) + y) * 224 + int(w[0]) + x) % map.size()])
	return samples


static func pattern(what, part):
	var map = Atlas.zeros()
	for i in Samples.MAP_LEN:
		var u = i % 224 + 0.5
		var v = i / 224 + 0.5
		var p = 0.0
		for g in what.get("gaussians", []):
			p += g[3] * exp(-((u - g[0]) * (u - g[0]) + (v - g[1]) * (v - g[1])) / (2 * g[2] * g[2]))
		if what.has("disc"):
			var d = what.disc
			if (u - d[0]) * (u - d[0]) + (v - d[1]) * (v - d[1]) <= d[2] * d[2]:
				p += d[3]
		if p >= 1:
			map[i] = p * part
	if what.has("bad"):
		var value = what.bad[2]
		if typeof(value) == TYPE_STRING:
			value = NAN if value == "nan" else INF
		map[int(what.bad[0]) * 224 + int(what.bad[1])] = value
	return map
