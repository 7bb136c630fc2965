# Generated: run clients/godot/generate, which makes it of clients/godot/godot3/addons/papilla/plugin.gd. Edit that file, not this one.
@tool
extends EditorPlugin


func _enter_tree():
	add_custom_type("PapillaSession", "Node", preload("session.gd"), null)


func _exit_tree():
	remove_custom_type("PapillaSession")
