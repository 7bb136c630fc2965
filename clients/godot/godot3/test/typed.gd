# A case's hello built from the client's types, member by member: `fault` says what they lack, or say otherwise.
extends Reference

const Hello = preload("res://addons/papilla/hello.gd")

var fault = ""
var shapes = {"sphere": Hello.ShapeSphere, "mesh": Hello.ShapeMesh, "plate": Hello.ShapePlate}
var effects = {
	"summary": Hello.SummaryEffect, "points": Hello.PointsEffect, "actuators": Hello.ActuatorsEffect, "afferents": Hello.AfferentsEffect,
	"relaxation": Hello.RelaxationEffect, "contact_window": Hello.ContactWindowEffect, "spikes": Hello.SpikesEffect, "shear_energy": Hello.ShearEnergyEffect,
}
# What the items of lists are.
var items = {"objects": Hello.TouchObject, "fingers": Hello.TouchFinger, "actuators": Hello.Actuator, "prony": Hello.PronyTerm, "points": Hello.SkinPoint}


func hello_of(json):
	var hello = Hello.new()
	var names = json.get("effects", [])
	for key in json:
		if key != "effects" and not names.has(key):
			_put(hello, key, json[key])
	for name in names:
		hello.effects.append(_effect(name, json.get(name)))
	_holds("hello", json, hello.words())
	return hello


func _effect(name, parameters):
	# A case without its parameters asks for a refusal.
	if not effects.has(name) or (name == "actuators" and parameters == null):
		return Hello.OtherEffect.new().with({"name": name})
	var effect = effects[name].new()
	if parameters is Array:
		parameters = {name: parameters}
	return _filled(effect, {} if parameters == null else parameters)


func _filled(of, json):
	for key in json:
		_put(of, {"max": "intensity_max", "seed": "random_seed"}.get(key, key), json[key])
	return of


func _put(of, key, value):
	if not key in of and "material" in of:
		_put(of.material, key, value)
	elif not key in of:
		fault = "no member " + key
	elif items.has(key):
		var list = []
		for each in value:
			list.append(_filled(items[key].new(), each))
		of.with({key: list})
	elif key == "shape":
		var shape = shapes[value.shape].new()
		for member in value:
			if member != "shape":
				_put(shape, member, value[member])
		of.with({key: shape})
	elif key == "at":
		of.with({key: _filled(Hello.SkinPoint.new(), value)})
	elif key == "mm":
		of.with({key: Vector3(value[0], value[1], value[2])})
	elif key == "px":
		of.with({key: Vector2(value[0], value[1])})
	else:
		of.with({key: value})


# All that is due is there; what is left out is a default.
func _holds(where, due, found):
	if due is Dictionary:
		for key in due:
			if found.has(key):
				_holds(where + "." + key, due[key], found[key])
			elif not str(due[key]) in ["f32", "clamp"]:
				fault = "%s.%s is not said" % [where, key]
	elif due is Array:
		if due.size() != found.size():
			fault = "%s has %d" % [where, found.size()]
			return
		for k in due.size():
			_holds(where, due[k], found[k])
	elif typeof(due) == TYPE_REAL:
		# Vectors are of single precision.
		if abs(due - found) > 1e-5 * abs(due):
			fault = "%s is %s" % [where, found]
	elif due != found:
		fault = "%s is %s" % [where, found]
