# A WebSocket to the server, for one connection. This file is for Godot 3.
extends Reference

# A frame has up to 200 768 bytes; Godot's buffers have 64 KiB unless they are asked for before connecting.
const BUFFER_KB = 2048
const BUFFER_PACKETS = 256

# It was opened; it ended, or never began.
var has_begun = false
var has_ended = false

var _socket = WebSocketClient.new()


# `url` starts with ws:// or wss://. False where it is no address.
func open(url):
	_socket.set_buffers(BUFFER_KB, BUFFER_PACKETS, BUFFER_KB, BUFFER_PACKETS)
	_socket.connect("connection_established", self, "_on_begin")
	_socket.connect("connection_closed", self, "_on_end")
	_socket.connect("connection_error", self, "_on_end")
	return _socket.connect_to_url(url) == OK


# Moves bytes; true once, when the connection is there.
func poll():
	var had_begun = has_begun
	_socket.poll()
	if not has_begun or had_begun:
		return false
	# On by default too; said here because everything hangs on it.
	_socket.get_peer(1).set_no_delay(true)
	return true


# The next message: a String, or bytes; null where there is none.
func next():
	if has_ended:
		return null
	var peer = _socket.get_peer(1)
	if peer.get_available_packet_count() == 0:
		return null
	var packet = peer.get_packet()
	return packet.get_string_from_utf8() if peer.was_string_packet() else packet


func send_text(text):
	var peer = _socket.get_peer(1)
	peer.set_write_mode(WebSocketPeer.WRITE_MODE_TEXT)
	peer.put_packet(text.to_utf8())


# False where the connection is lost.
func send_bytes(bytes):
	var peer = _socket.get_peer(1)
	peer.set_write_mode(WebSocketPeer.WRITE_MODE_BINARY)
	return peer.put_packet(bytes) == OK


# Whether frames can go.
func is_open():
	return _socket.get_connection_status() == NetworkedMultiplayerPeer.CONNECTION_CONNECTED


func close():
	for name in ["connection_established", "connection_closed", "connection_error"]:
		for connection in _socket.get_signal_connection_list(name):
			_socket.disconnect(name, connection.target, connection.method)
	_socket.disconnect_from_host()


# What the socket tells while it polls is only noted: it must not be freed within its own signals.
func _on_begin(_protocol):
	has_begun = true


func _on_end(_was_clean = false):
	has_ended = true
