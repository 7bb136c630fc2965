# Made of clients/godot/godot3/addons/papilla/atlas.gd by clients/godot/generate: edit that one.
# The atlas: which point of the finger each pixel of a map is, and how to fill a map (docs/reference/atlas.md).
extends RefCounted

const Compat = preload("compat.gd")
const SIDE_PX = 224
const REACH_MM = 5.0
const RADIUS_AT_1_N_MM = 5.1
const BLOCK_PX = 12

var hash_hex = ""
# Corners of the triangles, three each.
var triangles = PackedInt32Array()
# x, y, z of the skin's vertices, mm; u, v in pixels, v down; the same of the interface, where SED is read.
var skin_mm = PackedFloat32Array()
var skin_uv_px = PackedFloat32Array()
var interface_mm = PackedFloat32Array()
var interface_uv_px = PackedFloat32Array()
# Pixels of the skin in the order of their triangles, three weights each; those of triangle t begin at first[t].
var pixels = PackedInt32Array()
var weights = PackedFloat32Array()
var first = PackedInt32Array()
# Area of the skin that each of these pixels shows, mm2, and where it lies, mm.
var areas_mm2 = PackedFloat32Array()
var places_mm = PackedFloat32Array()

# The same pixels block by block: what contacts read.
var _places = []
var _areas = []
var _indices = []
var _blocks = []


# From the text of GET /v1/atlas. Takes about a second.
func _init(text):
	var json = JSON.parse_string(text)
	hash_hex = json.hash
	for triangle in json.triangles:
		for corner in triangle:
			triangles.append(int(corner))
	skin_mm = _flat(json.skin.positions_mm)
	skin_uv_px = _flat(json.skin.uv_px)
	interface_mm = _flat(json.interface.positions_mm)
	interface_uv_px = _flat(json.interface.uv_px)
	_claim_all()
	_place_pixels()
	_sort_into_blocks()


func vertex_count():
	return skin_mm.size() / 3


static func _flat(rows):
	var values = PackedFloat32Array()
	for row in rows:
		for value in row:
			values.append(value)
	return values


# Pressures at the skin's vertices (Pa) as a map of 224 x 224 floats, linear in each triangle.
func pressure_map(vertex_pa):
	var map = zeros()
	for t in triangles.size() / 3:
		var a = vertex_pa[triangles[3 * t]]
		var b = vertex_pa[triangles[3 * t + 1]]
		var c = vertex_pa[triangles[3 * t + 2]]
		# Most of the finger touches nothing.
		if a == 0 and b == 0 and c == 0:
			continue
		for n in range(first[t], first[t + 1]):
			map[pixels[n]] = weights[3 * n] * a + weights[3 * n + 1] * b + weights[3 * n + 2] * c
	return map


# Contact points [{at_mm = Vector3 or array, force_n, radius_mm}] as a map: each is the pressure of Hertz's contact of that force and
# radius around the nearest point of the skin; one more than 5 mm off the skin adds nothing. Without a radius it is the finger's own
# on a flat object.
func contact_map(contacts):
	var map = zeros()
	for contact in contacts:
		var radius_mm = contact.get("radius_mm", RADIUS_AT_1_N_MM * pow(contact.force_n, 1.0 / 3.0))
		map = _add_contact(map, contact.at_mm, contact.force_n, radius_mm)
	return map


func _add_contact(map, at, force_n, radius_mm):
	var nearest = _nearest(Vector3(at[0], at[1], at[2]))
	if nearest < 0:
		return map
	# Of locals and plain arrays, since this loop is what a contact costs.
	var places = _places
	var areas = _areas
	var own = places[nearest]
	var per_mm2 = 1.0 / (radius_mm * radius_mm)
	var touched = [nearest]
	var parts = [1.0]
	var total = areas[nearest]
	for block in _blocks:
		if own.distance_to(block.centre) > radius_mm + block.radius:
			continue
		for n in range(block.first, block.end):
			var part = 1.0 - own.distance_squared_to(places[n]) * per_mm2
			if part > 0.0 and n != nearest:
				part = sqrt(part)
				total += part * areas[n]
				touched.append(n)
				parts.append(part)
	var top_pa = 1e6 * force_n / total
	var indices = _indices
	for k in touched.size():
		map[indices[touched[k]]] += top_pa * parts[k]
	# Arrays of floats are handed over by value in Godot 3: hence the return.
	return map


# The place of the skin's pixel nearest to a point, the first of equals; -1 beyond REACH_MM.
func _nearest(at):
	# No pixel of the nearest block can be farther than this.
	var within = REACH_MM
	for block in _blocks:
		within = min(within, at.distance_to(block.centre) + block.radius)
	var nearest = -1
	var least = REACH_MM * REACH_MM
	for block in _blocks:
		if at.distance_to(block.centre) - block.radius > within:
			continue
		for n in range(block.first, block.end):
			var d2 = at.distance_squared_to(_places[n])
			if d2 < least or (d2 == least and (nearest < 0 or _indices[n] < _indices[nearest])):
				least = d2
				nearest = n
	return nearest


# Pixels by squares of BLOCK_PX, each with the sphere that holds it: a contact looks at those that it may touch.
func _sort_into_blocks():
	var members = {}
	for n in pixels.size():
		var key = pixels[n] / SIDE_PX / BLOCK_PX * SIDE_PX + pixels[n] % SIDE_PX / BLOCK_PX
		if not members.has(key):
			members[key] = []
		members[key].append(n)
	for key in members:
		var centre = Vector3()
		var begin = _places.size()
		for n in members[key]:
			_places.append(Vector3(places_mm[3 * n], places_mm[3 * n + 1], places_mm[3 * n + 2]))
			_areas.append(areas_mm2[n])
			_indices.append(pixels[n])
			centre += _places[_places.size() - 1] / members[key].size()
		var radius = 0.0
		for n in range(begin, _places.size()):
			radius = max(radius, centre.distance_to(_places[n]))
		_blocks.append({"centre": centre, "radius": radius + 1e-4, "first": begin, "end": _places.size()})


# Force of a pressure map over the undeformed skin, N.
func force_n(map):
	var sum = 0.0
	for n in pixels.size():
		sum += 1e-6 * map[pixels[n]] * areas_mm2[n]
	return sum


# A map without pressure.
static func zeros():
	return Compat.zeros()


func _claim_all():
	var taken = PackedByteArray()
	taken.resize(SIDE_PX * SIDE_PX)
	for i in taken.size():
		taken[i] = 0
	for t in triangles.size() / 3:
		first.append(pixels.size())
		var a = 2 * triangles[3 * t]
		var b = 2 * triangles[3 * t + 1]
		var c = 2 * triangles[3 * t + 2]
		var au = skin_uv_px[a]
		var av = skin_uv_px[a + 1]
		var bu = skin_uv_px[b]
		var bv = skin_uv_px[b + 1]
		var cu = skin_uv_px[c]
		var cv = skin_uv_px[c + 1]
		var total = (bu - au) * (cv - av) - (bv - av) * (cu - au)
		var turn = sign(total)
		for row in range(max(0, floor(min(av, min(bv, cv)) - 0.5)), min(SIDE_PX, ceil(max(av, max(bv, cv)) + 0.5))):
			for column in range(max(0, floor(min(au, min(bu, cu)) - 0.5)), min(SIDE_PX, ceil(max(au, max(bu, cu)) + 0.5))):
				var i = row * SIDE_PX + column
				var u = column + 0.5
				var v = row + 0.5
				var wa = (cu - bu) * (v - bv) - (cv - bv) * (u - bu)
				var wb = (au - cu) * (v - cv) - (av - cv) * (u - cu)
				var wc = (bu - au) * (v - av) - (bv - av) * (u - au)
				if taken[i] or wa * turn < 0 or wb * turn < 0 or wc * turn < 0:
					continue
				taken[i] = 1
				pixels.append(i)
				for weight in [wa, wb, wc]:
					weights.append(weight / total)
	first.append(pixels.size())


func _place_pixels():
	for t in triangles.size() / 3:
		var a = triangles[3 * t]
		var b = triangles[3 * t + 1]
		var c = triangles[3 * t + 2]
		var e = []
		var f = []
		for k in 3:
			e.append(skin_mm[3 * b + k] - skin_mm[3 * a + k])
			f.append(skin_mm[3 * c + k] - skin_mm[3 * a + k])
		var nx = e[1] * f[2] - e[2] * f[1]
		var ny = e[2] * f[0] - e[0] * f[2]
		var nz = e[0] * f[1] - e[1] * f[0]
		var bu = skin_uv_px[2 * b] - skin_uv_px[2 * a]
		var bv = skin_uv_px[2 * b + 1] - skin_uv_px[2 * a + 1]
		var cu = skin_uv_px[2 * c] - skin_uv_px[2 * a]
		var cv = skin_uv_px[2 * c + 1] - skin_uv_px[2 * a + 1]
		var area = sqrt(nx * nx + ny * ny + nz * nz) / abs(bu * cv - bv * cu)
		for n in range(first[t], first[t + 1]):
			areas_mm2.append(area)
			for k in 3:
				places_mm.append(weights[3 * n] * skin_mm[3 * a + k] + weights[3 * n + 1] * skin_mm[3 * b + k] + weights[3 * n + 2] * skin_mm[3 * c + k])
