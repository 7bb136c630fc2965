# Made of clients/godot/godot3/addons/papilla/http.gd by clients/godot/generate: edit that one.
# What needs no session: the atlas, and one map at a time. Calls wait for the answer: make them while a scene loads, or in a Thread.
extends RefCounted

const Compat = preload("compat.gd")


# {status, headers, body}; status 0 where no answer came within `patience_ms`.
static func fetch(url, path, method = HTTPClient.METHOD_GET, headers = [], body = PackedByteArray(), patience_ms = 10000):
	var parts = url.split("://")
	var host = parts[1].rstrip("/").split(":")
	var is_tls = parts[0] == "https"
	var port = int(host[1]) if host.size() > 1 else (443 if is_tls else 80)
	var http = HTTPClient.new()
	http.blocking_mode_enabled = false
	http.read_chunk_size = 1 << 20
	Compat.connect_http(http, host[0], port, is_tls)
	var end = Time.get_ticks_msec() + patience_ms
	var answer = {"status": 0, "headers": {}, "body": PackedByteArray()}
	var is_asked = false
	while Time.get_ticks_msec() < end:
		http.poll()
		var status = http.get_status()
		if status == HTTPClient.STATUS_CONNECTED and not is_asked:
			is_asked = true
			http.request_raw(method, "/" + path, headers, body)
		elif is_asked and http.has_response():
			answer.status = http.get_response_code()
			answer.headers = http.get_response_headers_as_dictionary()
			# A variable of its own: what is in a Dictionary is a copy, to which nothing can be appended.
			var received = PackedByteArray()
			while http.get_status() == HTTPClient.STATUS_BODY and Time.get_ticks_msec() < end:
				http.poll()
				received.append_array(http.read_response_body_chunk())
			answer.body = received
			return answer
		elif status == HTTPClient.STATUS_CANT_CONNECT or status == HTTPClient.STATUS_CANT_RESOLVE or status == HTTPClient.STATUS_CONNECTION_ERROR:
			return answer
		OS.delay_msec(1)
	return answer


static func _headers(token):
	var headers = ["Content-Type: application/octet-stream", "Accept: application/octet-stream, application/json;q=0.5"]
	if token != "":
		headers.append("Authorization: Bearer " + token)
	return headers


# The text for Atlas.new; "" where the server does not answer.
static func atlas_text(url, token = ""):
	var answer = fetch(url, "v1/atlas", HTTPClient.METHOD_GET, _headers(token))
	return answer.body.get_string_from_utf8() if answer.status == 200 else ""


# {map: 224 x 224 floats (J/m3), tier} or {problem: {code, message, field}}.
static func post_pressure(url, pressure_pa, tier = "", token = ""):
	var path = "v1/sed" + ("?tier=" + tier.uri_encode() if tier != "" else "")
	var answer = fetch(url, path, HTTPClient.METHOD_POST, _headers(token), Compat.floats_to_bytes(pressure_pa))
	if answer.status == 0:
		return {"problem": {"code": "no_answer", "message": "no answer from " + url, "field": null}}
	if answer.status != 200:
		return {"problem": JSON.parse_string(answer.body.get_string_from_utf8()).error}
	return {"map": Compat.bytes_to_floats(answer.body), "tier": answer.headers.get("x-papilla-tier", "")}
