# Made of clients/godot/godot3/addons/papilla/plugin.gd by clients/godot/generate: edit that one.
@tool
extends EditorPlugin


func _enter_tree():
	add_custom_type("PapillaSession", "Node", preload("session.gd"), null)


func _exit_tree():
	remove_custom_type("PapillaSession")
