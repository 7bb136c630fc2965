# Generated: run clients/godot/generate, which makes it of clients/godot/godot3/addons/papilla/typed.gd. Edit that file, not this one.
# What the types of hello.gd share.
extends RefCounted


# Sets members by their names, and returns itself; a name that there is none of is an error.
func with(values):
	for name in values:
		if name in self:
			set(name, values[name])
		else:
			push_error("papilla: there is no member '%s'" % name)
	return self


# A value as on the wire: types as their members, vectors and arrays as arrays.
func plain(value):
	if value is Vector3:
		return [value.x, value.y, value.z]
	if value is Vector2:
		return [value.x, value.y]
	if typeof(value) == TYPE_OBJECT:
		return value.words()
	if typeof(value) < TYPE_ARRAY:
		return value
	var values = []
	for each in value:
		values.append(plain(each))
	return values
