# Generated: run clients/godot/generate, which makes it of clients/godot/godot3/addons/papilla/atlas.gd. Edit that file, not this one.
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

# What contacts read, block by block. The map in threes of its samples, so that one operation takes three: `_offsets` takes a place
# beside the block's centre, u, to 2 p.u - p.p of their places p, and adding R^2 - u.u gives R^2 minus the squared distance.
var _places = []
var _indices = []
var _threes = []
var _offsets = []
var _areas = []
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
	var map = null
	for contact in contacts:
		var near = []
		var added = _contact_threes(contact, near)
		if map == null:
			map = added
			continue
		for block in near:
			for n in block.threes:
				map[_threes[n]] += added[_threes[n]]
	return zeros() if map == null else Compat.threes_to_floats(map)


# One contact as threes of samples; `near` takes the blocks that it reaches.
func _contact_threes(contact, near):
	var map = Compat.zero_threes()
	var nearest = _nearest(Vector3(contact.at_mm[0], contact.at_mm[1], contact.at_mm[2]))
	if nearest < 0:
		return map
	var own = _places[nearest]
	# What is narrower than .01 mm is on that pixel alone as well.
	var radius_mm = max(contact.get("radius_mm", RADIUS_AT_1_N_MM * pow(contact.force_n, 1.0 / 3.0)), 0.01)
	# Of locals and plain arrays, since this loop is what a contact costs.
	var offsets = _offsets
	var areas = _areas
	var threes = _threes
	var total = 0.0
	for block in _blocks:
		var distance = own.distance_to(block.centre)
		if distance > radius_mm + block.radius:
			continue
		near.append(block)
		var u = own - block.centre
		var rest = radius_mm * radius_mm - u.length_squared()
		rest = Vector3(rest, rest, rest)
		if block.whole and distance + block.radius < radius_mm:
			for n in block.threes:
				var part = offsets[n] * u + rest
				part = Vector3(sqrt(part.x), sqrt(part.y), sqrt(part.z))
				total += areas[n].dot(part)
				map[threes[n]] = part
			continue
		for n in block.threes:
			var part = offsets[n] * u + rest
			if part.x > 0.0 or part.y > 0.0 or part.z > 0.0:
				part = Vector3(sqrt(max(part.x, 0.0)), sqrt(max(part.y, 0.0)), sqrt(max(part.z, 0.0)))
				total += areas[n].dot(part)
				map[threes[n]] = part
	return Compat.scaled_threes(map, 1e6 * contact.force_n / total)


# The place of the skin's pixel nearest to a point, the first of equals; -1 beyond REACH_MM.
func _nearest(at):
	# The block with the nearest centre first: hardly another is as near as its nearest pixel.
	var first_block = _blocks[0]
	for block in _blocks:
		if at.distance_squared_to(block.centre) < at.distance_squared_to(first_block.centre):
			first_block = block
	var nearest = -1
	var within = REACH_MM
	for block in [first_block] + _blocks:
		if at.distance_to(block.centre) - block.radius > within:
			continue
		for n in block.pixels:
			var distance = at.distance_to(_places[n])
			if distance < within or (distance == within and (nearest < 0 or _indices[n] < _indices[nearest])):
				within = distance
				nearest = n
	return nearest


# Blocks of BLOCK_PX by BLOCK_PX pixels, each with the sphere that holds it: a contact looks at those that it may touch.
func _sort_into_blocks():
	var members = {}
	for n in pixels.size():
		var three = pixels[n] / 3
		var key = 3 * three / SIDE_PX / BLOCK_PX * SIDE_PX + 3 * three % SIDE_PX / BLOCK_PX
		if not members.has(key):
			members[key] = {}
		if not members[key].has(three):
			members[key][three] = [-1, -1, -1]
		members[key][three][pixels[n] % 3] = n
	for key in members:
		_add_block(members[key])


# Of pixels by their threes: -1 where a sample is none of the skin.
func _add_block(members):
	var begin = _threes.size()
	var first_pixel = _places.size()
	var centre = Vector3()
	for three in members:
		for n in members[three]:
			if n >= 0:
				_places.append(Vector3(places_mm[3 * n], places_mm[3 * n + 1], places_mm[3 * n + 2]))
				_indices.append(pixels[n])
				centre += _places[-1]
	centre /= _places.size() - first_pixel
	var radius = 0.0
	var whole = true
	for three in members:
		var p = []
		# No contact reaches what is none of the skin.
		var squares = Vector3(1e6, 1e6, 1e6)
		var area = Vector3()
		for k in 3:
			var n = members[three][k]
			p.append(Vector3())
			if n < 0:
				whole = false
				continue
			p[k] = Vector3(places_mm[3 * n], places_mm[3 * n + 1], places_mm[3 * n + 2]) - centre
			squares[k] = p[k].length_squared()
			area[k] = areas_mm2[n]
			radius = max(radius, p[k].length())
		var columns = []
		for axis in 3:
			columns.append(2.0 * Vector3(p[0][axis], p[1][axis], p[2][axis]))
		_threes.append(three)
		_offsets.append(Transform3D(columns[0], columns[1], columns[2], -squares))
		_areas.append(area)
	_blocks.append({"centre": centre, "radius": radius + 1e-4, "whole": whole,
		"threes": range(begin, _threes.size()), "pixels": range(first_pixel, _places.size())})


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
