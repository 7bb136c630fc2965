# Generated: run clients/godot/generate, which makes it of clients/godot/godot3/addons/papilla/hello.gd. Edit that file, not this one.
# Generated: run clients/hello/generate, which makes it of clients/hello/members.py. Edit that file, not this one.
# What a session asks for, as types: docs/reference/protocol-hello.md. Members that are not set take the service's default.
#
#   var ball = Hello.TouchObject.new().with({"shape": Hello.ShapeSphere.new().with({"radius_mm": 10.0})})
#   session.hello = Hello.new().with({"objects": [ball], "map": false})
extends "res://addons/papilla/typed.gd"

const Typed = preload("res://addons/papilla/typed.gd")


# What frames hold. Null: objects if there are any in the hello, pressure if not. One of "pressure", "objects", "gaps".
var input = null
# Places of the samples of pressure or gaps. One of "map", "vertices".
var input_layout = "map"
# Type of the samples of frames. Poses are f32; gaps are f32 or f16. One of "f32", "f16", "u16", "u8".
var sample_type = "f32"
# Pressure that one unit of a u16 or u8 sample stands for, Pa.
var pressure_scale_pa = null
# What happens to pressure beyond the training. One of "clamp", "flag", "refuse".
var out_of_range = "clamp"
# Frames of pressure at vertices also hold the traction.
var traction = false
# The objects, 1 to 16, whose poses frames hold.
var objects = []
# The fingers, 1 to 10. None: the default finger alone.
var fingers = []
# Each frame holds a net force with which the objects are to press.
var force_target = false
# Coulomb's coefficient of friction of what gaps tell of: 0 to 10. Null: none.
var friction = null
# Frames of gaps also hold velocities, mm/s.
var velocity = false
# A frame that was delayed for longer on its way is stale, us. Null: none is.
var stale_after_us = null
# False: answers carry no SED at pixels or vertices.
var map = true
# Places of the SED in answers. One of "map", "vertices".
var answer_layout = "map"
# Type of SED and firing rates in answers. Null: that of frames. One of "f32", "f16", "u16", "u8".
var answer_sample_type = null
# Answers to objects and gaps carry the pressure that was found, Pa, at these places. One of "map", "vertices".
var pressure = null
# Answers to objects and gaps carry the traction along the skin, Pa, at the vertices.
var shear = false
# Answers to objects and gaps carry how far the skin has moved, mm, at the vertices.
var displacement = false
# Answers say how wrong they are likely to be.
var error_estimate = false
# Answers to objects and gaps carry the local stiffness, N/mm.
var stiffness = false
# What is computed beside the map; nothing else is.
var effects = []
# Pressure above which a pixel counts as in contact, Pa.
var contact_pa = 0.0
# A tier by its name. Null: the service chooses, by the budget if there is one.
var tier = null
# Time that a frame may spend in the service, us. Null: no deadline.
var budget_us = null
# How contact is solved. Null: the most accurate method that can serve the hello. One of "pixels", "coarse_pixels", "second_order", "small_strain", "springs".
var method = null
# Hash of the atlas that you draw with; the hello is refused if the tier has another.
var atlas_hash = null
# Members that this client does not know, as on the wire; they are said last.
var more = {}


# All members as on the wire, without type and version.
func words():
	var json = {}
	if input != null:
		json["input"] = plain(input)
	if input_layout != "map":
		json["input_layout"] = plain(input_layout)
	if sample_type != "f32":
		json["sample_type"] = plain(sample_type)
	if pressure_scale_pa != null:
		json["pressure_scale_pa"] = plain(pressure_scale_pa)
	if out_of_range != "clamp":
		json["out_of_range"] = plain(out_of_range)
	if traction:
		json["traction"] = plain(traction)
	if objects.size() > 0:
		json["objects"] = plain(objects)
	if fingers.size() > 0:
		json["fingers"] = plain(fingers)
	if force_target:
		json["force_target"] = plain(force_target)
	if friction != null:
		json["friction"] = plain(friction)
	if velocity:
		json["velocity"] = plain(velocity)
	if stale_after_us != null:
		json["stale_after_us"] = plain(stale_after_us)
	if not map:
		json["map"] = plain(map)
	if answer_layout != "map":
		json["answer_layout"] = plain(answer_layout)
	if answer_sample_type != null:
		json["answer_sample_type"] = plain(answer_sample_type)
	if pressure != null:
		json["pressure"] = plain(pressure)
	if shear:
		json["shear"] = plain(shear)
	if displacement:
		json["displacement"] = plain(displacement)
	if error_estimate:
		json["error_estimate"] = plain(error_estimate)
	if stiffness:
		json["stiffness"] = plain(stiffness)
	if contact_pa != 0.0:
		json["contact_pa"] = plain(contact_pa)
	if tier != null:
		json["tier"] = plain(tier)
	if budget_us != null:
		json["budget_us"] = plain(budget_us)
	if method != null:
		json["method"] = plain(method)
	if atlas_hash != null:
		json["atlas_hash"] = plain(atlas_hash)
	if input == null and objects.size() > 0:
		json["input"] = "objects"
	if effects.size() > 0:
		json["effects"] = []
	for each in effects:
		json["effects"].append(each.effect())
		if each.words() != null:
			json[each.effect()] = each.words()
	for member in more:
		json[member] = more[member]
	return json


# A flat plate with rounded edges, 4 mm and twice the edge radius thick. Its origin is its middle.
class ShapePlate extends Typed:
	# Side lengths along x and y, mm.
	var size_mm = [20.0, 20.0]
	# Radius of its edges, mm: 0 to half the shorter side.
	var edge_radius_mm = 1.0
	func words():
		var json = {"shape": "plate"}
		json["size_mm"] = plain(size_mm)
		json["edge_radius_mm"] = plain(edge_radius_mm)
		return json


# A ball. Its origin is its centre.
class ShapeSphere extends Typed:
	# Radius, mm.
	var radius_mm = 5.0
	func words():
		var json = {"shape": "sphere"}
		json["radius_mm"] = plain(radius_mm)
		return json


# A bar that lies along its y, with rounded ends. Its origin is the middle of its axis.
class ShapeCylinder extends Typed:
	# Radius, mm.
	var radius_mm = 3.0
	# Length with its rounded ends, mm.
	var length_mm = 30.0
	# Rounds the ends, mm: at most the radius; equal to it they are half spheres.
	var end_radius_mm = 1.0
	func words():
		var json = {"shape": "cylinder"}
		json["radius_mm"] = plain(radius_mm)
		json["length_mm"] = plain(length_mm)
		json["end_radius_mm"] = plain(end_radius_mm)
		return json


# A blunt wedge along its y. Its origin is the middle of its tip.
class ShapeWedge extends Typed:
	# Width at the tip, mm, before its edges are rounded.
	var tip_width_mm = 0.05
	# Width at the base, mm, before its edges are rounded: at least that at the tip.
	var base_width_mm = 1.0
	# Height, mm.
	var height_mm = 2.0
	# Radius of all edges, mm.
	var tip_radius_mm = 0.02
	# Length along y, mm.
	var length_mm = 30.0
	func words():
		var json = {"shape": "wedge"}
		json["tip_width_mm"] = plain(tip_width_mm)
		json["base_width_mm"] = plain(base_width_mm)
		json["height_mm"] = plain(height_mm)
		json["tip_radius_mm"] = plain(tip_radius_mm)
		json["length_mm"] = plain(length_mm)
		return json


# An upright cylinder with a flat end. Its origin is the middle of that end.
class ShapePunch extends Typed:
	# Outer radius, mm.
	var radius_mm = 3.0
	# Rounds the rim, mm: at most the radius and half the height.
	var rim_radius_mm = 0.25
	# Height, mm.
	var height_mm = 6.0
	func words():
		var json = {"shape": "punch"}
		json["radius_mm"] = plain(radius_mm)
		json["rim_radius_mm"] = plain(rim_radius_mm)
		json["height_mm"] = plain(height_mm)
		return json


# The end of an upright tube. Its origin is the middle of that end.
class ShapeRing extends Typed:
	# Outer radius, mm.
	var outer_radius_mm = 4.0
	# Radius of the hole, mm: below the outer radius.
	var inner_radius_mm = 3.0
	# Rounds all four rims, mm: at most half the wall and half the height.
	var rim_radius_mm = 0.25
	# Height, mm.
	var height_mm = 6.0
	func words():
		var json = {"shape": "ring"}
		json["outer_radius_mm"] = plain(outer_radius_mm)
		json["inner_radius_mm"] = plain(inner_radius_mm)
		json["rim_radius_mm"] = plain(rim_radius_mm)
		json["height_mm"] = plain(height_mm)
		return json


# A box with rounded edges. Its origin is its middle.
class ShapeBox extends Typed:
	# Side lengths along x, y and z, mm.
	var size_mm = [10.0, 10.0, 10.0]
	# Radius of its edges, mm: above 0, at most half the shortest side.
	var edge_radius_mm = 1.0
	func words():
		var json = {"shape": "box"}
		json["size_mm"] = plain(size_mm)
		json["edge_radius_mm"] = plain(edge_radius_mm)
		return json


# A bar that lies along its y and ends in half balls. Its origin is its middle.
class ShapeCapsule extends Typed:
	# Radius, mm.
	var radius_mm = 3.0
	# Length with both half balls, mm: at least twice the radius.
	var length_mm = 20.0
	func words():
		var json = {"shape": "capsule"}
		json["radius_mm"] = plain(radius_mm)
		json["length_mm"] = plain(length_mm)
		return json


# A ring of round section that lies flat, its hole along its z. Its origin is its middle.
class ShapeTorus extends Typed:
	# Radius of the circle in the middle of the tube, mm.
	var radius_mm = 4.0
	# Radius of the tube, mm: below that of the circle.
	var tube_radius_mm = 1.0
	func words():
		var json = {"shape": "torus"}
		json["radius_mm"] = plain(radius_mm)
		json["tube_radius_mm"] = plain(tube_radius_mm)
		return json


# Ridges along y on a base. Its origin lies in the plane of their tops, in the middle.
class ShapeGrating extends Typed:
	# Number of ridges: 1 to 1000.
	var ridges = 5
	# Width of a ridge, mm.
	var ridge_mm = 1.5
	# Width of a groove, mm.
	var groove_mm = 1.5
	# Depth of the grooves, mm.
	var height_mm = 1.5
	# Radius of all edges, mm: at most half a ridge, half the length and 2 mm.
	var edge_radius_mm = 0.25
	# Length along y, mm.
	var length_mm = 20.0
	func words():
		var json = {"shape": "grating"}
		json["ridges"] = plain(ridges)
		json["ridge_mm"] = plain(ridge_mm)
		json["groove_mm"] = plain(groove_mm)
		json["height_mm"] = plain(height_mm)
		json["edge_radius_mm"] = plain(edge_radius_mm)
		json["length_mm"] = plain(length_mm)
		return json


# Spherical caps on a plate, by default a Braille cell. Its origin lies in the plane of their tops, in the middle.
class ShapeDots extends Typed:
	# Dots along x and y: 1 to 1000 each.
	var count = [3, 2]
	# Distance of neighbours, mm: at least the width of a dot.
	var pitch_mm = 2.34
	# Width of a dot where it meets the plate, mm.
	var base_mm = 1.44
	# Height of a dot, mm: at most half its width.
	var height_mm = 0.48
	# Side lengths of the plate, mm; it has to hold the dots and 1 mm around them.
	var plate_mm = [20.0, 20.0]
	func words():
		var json = {"shape": "dots"}
		json["count"] = plain(count)
		json["pitch_mm"] = plain(pitch_mm)
		json["base_mm"] = plain(base_mm)
		json["height_mm"] = plain(height_mm)
		json["plate_mm"] = plain(plate_mm)
		return json


# A surface of listed heights. Its origin is the middle of the grid.
class ShapeHeightmap extends Typed:
	# Number of heights along x: 2 or more.
	var columns = 2
	# Distance between neighbouring heights along x and y, mm.
	var pixel_mm = [0.1, 0.1]
	# Heights above the origin, mm, row by row from the lowest y; two rows or more.
	var heights_mm = []
	func words():
		var json = {"shape": "heightmap"}
		json["columns"] = plain(columns)
		json["pixel_mm"] = plain(pixel_mm)
		json["heights_mm"] = plain(heights_mm)
		return json


# A mesh of at most 16 384 triangles. Its origin is that of its vertices. The service mends one that is not closed, and says so.
class ShapeMesh extends Typed:
	# x, y, z of each vertex, mm. Vector3s, or arrays of three.
	var vertices_mm = []
	# Three vertices for each triangle, counter-clockwise as seen from outside. Vector3s, or arrays of three.
	var triangles = []
	func words():
		var json = {"shape": "mesh"}
		json["vertices_mm"] = plain(vertices_mm)
		json["triangles"] = plain(triangles)
		return json


# Parts that move as one body.
class ShapeUnion extends Typed:
	# The parts, 1 to 64.
	var parts = []
	func words():
		var json = {"shape": "union"}
		json["parts"] = plain(parts)
		return json


# A part of a union, moved and turned in the union's axes.
class UnionPart extends Typed:
	# What it is: any shape but a union.
	var part = null
	# Where its own origin lies, mm.
	var at_mm = [0.0, 0.0, 0.0]
	# Turn about the union's z, degrees: the first of the three.
	var yaw_deg = 0.0
	# Turn about the union's y, degrees. A height map has to leave it 0.
	var pitch_deg = 0.0
	# Turn about the union's x, degrees. A height map has to leave it 0.
	var roll_deg = 0.0
	func words():
		var json = {}
		json["part"] = plain(part)
		json["at_mm"] = plain(at_mm)
		json["yaw_deg"] = plain(yaw_deg)
		json["pitch_deg"] = plain(pitch_deg)
		json["roll_deg"] = plain(roll_deg)
		return json


# What an object is made of, as far as the skin feels it.
class TouchMaterial extends Typed:
	# The pressure that pushes its surface in by 1 mm, MPa/mm: above 0. Null: it is rigid.
	var stiffness_mpa_per_mm = null
	# Coulomb's coefficient of friction with the skin: 0 to 10.
	var friction = 0.0
	func words():
		var json = {}
		if stiffness_mpa_per_mm != null:
			json["stiffness_mpa_per_mm"] = plain(stiffness_mpa_per_mm)
		json["friction"] = plain(friction)
		return json


# An object that can be touched; each frame gives its pose.
class TouchObject extends Typed:
	# Its shape, and its size in millimetres.
	var shape = null
	# What it is made of; by default rigid and without friction.
	var material = TouchMaterial.new()
	func words():
		var json = {}
		json["shape"] = plain(shape)
		var material_words = material.words()
		for key in material_words:
			json[key] = material_words[key]
		return json


# A finger of the session.
class TouchFinger extends Typed:
	# Which of the service's fingers it is, as GET /v1/fingers lists them. Null: the default finger.
	var name = null
	# Its width divided by that of the finger of this name: 0.25 to 4.
	var width = 1.0
	# Stiffness of its tissue divided by that of the finger of this name: 0.25 to 4.
	var stiffness = 1.0
	func words():
		var json = {}
		if name != null:
			json["name"] = plain(name)
		json["width"] = plain(width)
		json["stiffness"] = plain(stiffness)
		return json


# An actuator of a tactile display.
class Actuator extends Typed:
	# Its place on the finger.
	var at = null
	# Radius of what it averages over, or of its pin, mm. Null: that of the effect.
	var radius_mm = null
	# Intensity for each unit of the input above the threshold. Null: that of the effect.
	var gain = null
	# Input below which the intensity is 0. Null: that of the effect.
	var threshold = null
	func words():
		var json = {}
		json["at"] = plain(at)
		if radius_mm != null:
			json["radius_mm"] = plain(radius_mm)
		if gain != null:
			json["gain"] = plain(gain)
		if threshold != null:
			json["threshold"] = plain(threshold)
		return json


# A simulated nerve fibre.
class NerveUnit extends Typed:
	# Its class. One of "sa1", "ra", "pc".
	var unit_class = "sa1"
	# Its place on the finger.
	var at = null
	# Which of TouchSim's neurons of the class: 0 to 3, for ra 0 to 8.
	var model = 0
	func words():
		var json = {}
		json["class"] = plain(unit_class)
		json["at"] = plain(at)
		json["model"] = plain(model)
		return json


# A term of a Prony series.
class PronyTerm extends Typed:
	# Share of the modulus that relaxes: above 0; all together at most 0.99.
	var g = 0.0
	# Its time constant, s.
	var tau_s = 1.0
	func words():
		var json = {}
		json["g"] = plain(g)
		json["tau_s"] = plain(tau_s)
		return json


# Answers carry a summary: force, contact area and fourteen other numbers.
class SummaryEffect extends Typed:
	func effect():
		return "summary"
	func words():
		return null


# Answers carry SED at points of the finger.
class PointsEffect extends Typed:
	# The points, 1 to 1024.
	var points = []
	func effect():
		return "points"
	func words():
		return plain(points)


# Answers carry firing rates of slowly adapting nerve fibres, Hz.
class AfferentsEffect extends Typed:
	# Elastic modulus of the dermis, kPa.
	var e_ref_kpa = 80.0
	# Threshold, kPa.
	var theta_kpa = 8.0
	# Static sensitivity, Hz/kPa.
	var k_s_hz_per_kpa = 1.0
	# Dynamic sensitivity, Hz s/kPa.
	var k_d_hz_s_per_kpa = 0.2
	# False: no map of rates; points, summary and actuators still use them.
	var map = true
	func effect():
		return "afferents"
	func words():
		var json = {}
		json["e_ref_kpa"] = plain(e_ref_kpa)
		json["theta_kpa"] = plain(theta_kpa)
		json["k_s_hz_per_kpa"] = plain(k_s_hz_per_kpa)
		json["k_d_hz_s_per_kpa"] = plain(k_d_hz_s_per_kpa)
		json["map"] = plain(map)
		return json


# Answers carry when simulated nerve fibres fired.
class SpikesEffect extends Typed:
	# Seed of the random places, of the models of units and of the noise.
	var random_seed = 1
	# Slowly adapting units for each cm2.
	var sa1_per_cm2 = 70.0
	# Rapidly adapting units for each cm2.
	var ra_per_cm2 = 140.0
	# Pacinian units for each cm2.
	var pc_per_cm2 = 21.0
	# Units of your own in place of those at random, 1 to 4096.
	var units = []
	# Elastic modulus of the dermis, kPa.
	var e_ref_kpa = 80.0
	# Whether noise is added to the membranes.
	var noise = false
	# Most spikes in one answer: 1 to 16384.
	var spikes_max = 1024
	func effect():
		return "spikes"
	func words():
		var json = {}
		json["seed"] = plain(random_seed)
		json["sa1_per_cm2"] = plain(sa1_per_cm2)
		json["ra_per_cm2"] = plain(ra_per_cm2)
		json["pc_per_cm2"] = plain(pc_per_cm2)
		if units.size() > 0:
			json["units"] = plain(units)
		json["e_ref_kpa"] = plain(e_ref_kpa)
		json["noise"] = plain(noise)
		json["spikes_max"] = plain(spikes_max)
		return json


# Answers carry an intensity for each actuator of a tactile display.
class ActuatorsEffect extends Typed:
	# The actuators, 1 to 1024.
	var actuators = []
	# Radius of what an actuator averages over, or of its pin, mm, where it has none of its own.
	var radius_mm = null
	# Intensity for each unit of the input above the threshold, where an actuator has none of its own.
	var gain = null
	# Input below which the intensity is 0, in its unit.
	var threshold = 0.0
	# Greatest intensity.
	var intensity_max = 1.0
	# What drives them; firing rates need the effect afferents. One of "sed", "sa1_rate".
	var input = "sed"
	# How intensities are computed. One of "formula", "fitted", "corrected".
	var drive = "formula"
	func effect():
		return "actuators"
	func words():
		var json = {}
		json["actuators"] = plain(actuators)
		if radius_mm != null:
			json["radius_mm"] = plain(radius_mm)
		if gain != null:
			json["gain"] = plain(gain)
		json["threshold"] = plain(threshold)
		json["max"] = plain(intensity_max)
		json["input"] = plain(input)
		json["drive"] = plain(drive)
		return json


# The tissue creeps under a constant pressure.
class RelaxationEffect extends Typed:
	# Whose creep it is. One of "subcutaneous", "skin".
	var tissue = "subcutaneous"
	# A series of your own in place of the tissue's, one to six terms.
	var prony = []
	# Which stiffness the training had. One of "instantaneous", "long_term".
	var moduli = "instantaneous"
	func effect():
		return "relaxation"
	func words():
		var json = {}
		json["tissue"] = plain(tissue)
		if prony.size() > 0:
			json["prony"] = plain(prony)
		json["moduli"] = plain(moduli)
		return json


# SED takes account of traction along the skin; needs friction.
class ShearEnergyEffect extends Typed:
	func effect():
		return "shear_energy"
	func words():
		return null


# The map is cut to the region in contact.
class ContactWindowEffect extends Typed:
	# Margin around it, pixels.
	var margin_px = 24
	func effect():
		return "contact_window"
	func words():
		var json = {}
		json["margin_px"] = plain(margin_px)
		return json


# A shape that this client does not know: all its members, as on the wire.
class ShapeOther extends Typed:
	var json = {}
	func words():
		return json


# An effect that this client does not know, such as one of a tier: its name, and its parameters as on the wire; null: none.
class OtherEffect extends Typed:
	var name = ""
	var json = null
	func effect():
		return name
	func words():
		return json


# A place on the finger: `SkinPoint.new().with({"mm": Vector3(11.25, 0, -6.5)})`, or `"px": Vector2(112, 90)`.
class SkinPoint extends Typed:
	# The pixel nearest to this point of the undeformed finger, mm in the finger's frame; at most 2 mm off. Null: `px` it is.
	var mm = null
	# A point of the map, pixels; v down.
	var px = Vector2()
	func words():
		return {"px": plain(px)} if mm == null else {"mm": plain(mm)}
