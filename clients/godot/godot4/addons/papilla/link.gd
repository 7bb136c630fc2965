# A WebSocket to the server, for one connection. This file is for Godot 4.
extends RefCounted

# A frame has up to 200 768 bytes; Godot's buffers have 64 KiB unless they are asked for before connecting.
const BUFFER_BYTES = 1 << 21
const BUFFER_PACKETS = 256

# It was opened; it ended, or never began.
var has_begun = false
var has_ended = false

var _socket = WebSocketPeer.new()


# `url` starts with ws:// or wss://. False where it is no address.
func open(url):
	_socket.inbound_buffer_size = BUFFER_BYTES
	_socket.outbound_buffer_size = BUFFER_BYTES
	_socket.max_queued_packets = BUFFER_PACKETS
	return _socket.connect_to_url(url) == OK


# Moves bytes; true once, when the connection is there.
func poll():
	_socket.poll()
	var state = _socket.get_ready_state()
	has_ended = state == WebSocketPeer.STATE_CLOSED
	if has_begun or state != WebSocketPeer.STATE_OPEN:
		return false
	has_begun = true
	_socket.set_no_delay(true)
	return true


# The next message: a String, or bytes; null where there is none.
func next():
	if _socket.get_available_packet_count() == 0:
		return null
	var packet = _socket.get_packet()
	return packet.get_string_from_utf8() if _socket.was_string_packet() else packet


func send_text(text):
	_socket.send_text(text)


# False where the connection is lost.
func send_bytes(bytes):
	return _socket.send(bytes) == OK


# Whether frames can go.
func is_open():
	return has_begun


func close():
	_socket.close()
	_socket.poll()
