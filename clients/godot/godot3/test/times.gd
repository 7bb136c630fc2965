# How long the functions take that the page calls slow:
#   PAPILLA_ATLAS=$PWD/models/atlas.json godot3-server --path clients/godot/godot3 -s test/times.gd
extends SceneTree

const RUNS = 41


func _init():
	var file = File.new()
	file.open(OS.get_environment("PAPILLA_ATLAS"), File.READ)
	var text = file.get_as_text()
	file.close()
	var begin = OS.get_ticks_usec()
	var atlas = load("res://addons/papilla/atlas.gd").new(text)
	print("atlas: ", OS.get_ticks_usec() - begin, " us")
	var map = []
	for force_n in [0.1, 0.5, 2.0]:
		var least_us = 1e9
		for _run in range(RUNS):
			begin = OS.get_ticks_usec()
			map = atlas.contact_map([{"at_mm": [11.25, 0, -6.53], "force_n": force_n}])
			least_us = min(least_us, OS.get_ticks_usec() - begin)
		print("contact_map of ", force_n, " N: ", least_us, " us")
	var loop_us = 1e9
	for _run in range(RUNS):
		begin = OS.get_ticks_usec()
		var most = 0.0
		for i in range(map.size()):
			if map[i] > most:
				most = map[i]
		loop_us = min(loop_us, OS.get_ticks_usec() - begin)
	print("a loop over ", map.size(), " samples: ", loop_us, " us")
	quit()
