# Made of clients/godot/godot3/example/finger.gd by clients/godot/generate: edit that one.
# A contact of half a newton circles the pad; the SED map is shown as a picture. Replace `_contacts` by those of your game.
extends Control

const Atlas = preload("res://addons/papilla/atlas.gd")
const Http = preload("res://addons/papilla/http.gd")
# J/m3 shown as full red.
const SED_OF_WHITE = 300.0

var maps = 0
var _atlas

@onready var session = $Session
@onready var picture = $Picture


func _ready():
	_atlas = Atlas.new(Http.atlas_text(session.url, session.token))
	session.map_received.connect(_on_map)
	session.answered.connect(_on_answered)
	picture.modulate = Color(1 / SED_OF_WHITE, 1, 1)


func _contacts(angle):
	return [{"at_mm": [10 + 2 * cos(angle), 2 * sin(angle), -6.5], "force_n": 0.5, "radius_mm": 2.5}]


func _process(_delta):
	session.send(_atlas.contact_map(_contacts(TAU * Time.get_ticks_msec() / 1000.0)))


# No answer came in time, or the server refuses: nothing is shown, and actuators go to zero, until the next map.
func _on_answered(answer):
	if answer.status == "lost" or answer.status == "error":
		picture.texture = null


func _on_map(answer):
	maps += 1
	var texture = ImageTexture.create_from_image(session.image_of(answer))
	picture.texture = texture
