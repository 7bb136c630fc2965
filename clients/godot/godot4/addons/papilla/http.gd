# Generated: run clients/godot/generate, which makes it of clients/godot/godot3/addons/papilla/http.gd. Edit that file, not this one.
# What needs no session: the atlas, and one map at a time. Calls wait for the answer: make them while a scene loads, or in a Thread.
extends RefCounted

const Address = preload("address.gd")
const Compat = preload("compat.gd")


# {status, headers, body}; status 0 where no answer came within `patience_ms`, or where `url` is no address (address.gd).
static func fetch(url, path, method = HTTPClient.METHOD_GET, headers = [], body = PackedByteArray(), patience_ms = 10000):
	var answer = {"status": 0, "headers": {}, "body": PackedByteArray()}
	var address = Address.parse(url)
	if address.fault != "":
		push_error("papilla: " + address.fault)
		answer.fault = address.fault
		return answer
	var http = HTTPClient.new()
	http.blocking_mode_enabled = false
	http.read_chunk_size = 1 << 20
	Compat.connect_http(http, address.host, address.port, address.is_secure)
	var end = Time.get_ticks_msec() + patience_ms
	var is_asked = false
	while Time.get_ticks_msec() < end:
		http.poll()
		var status = http.get_status()
		if status == HTTPClient.STATUS_CONNECTED and not is_asked:
			is_asked = true
			http.request_raw(method, address.path + "/" + path, headers, body)
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
	var clean = Address.stripped(token)
	if not Address.is_token(clean):
		push_error("papilla: the token holds a blank, a line end or a character that no token has")
	elif clean != "":
		headers.append("Authorization: Bearer " + clean)
	return headers


# The text for Atlas.new; "" where the server does not answer.
static func atlas_text(url, token = ""):
	var answer = fetch(url, "v1/atlas", HTTPClient.METHOD_GET, _headers(token))
	return answer.body.get_string_from_utf8() if answer.status == 200 else ""


# {map: 224 x 224 floats (J/m3), tier} or {problem: {code, message, field}}.
static func post_pressure(url, pressure_pa, tier = "", token = ""):
	var path = "v1/sed" + ("?tier=" + tier.uri_encode() if tier != "" else "")
	var answer = fetch(url, path, HTTPClient.METHOD_POST, _headers(token), Compat.floats_to_bytes(pressure_pa))
	if answer.has("fault"):
		return {"problem": {"code": "bad_address", "message": answer.fault, "field": null}}
	if answer.status == 0:
		return {"problem": {"code": "no_answer", "message": "no answer from " + url, "field": null}}
	if answer.status != 200:
		return {"problem": JSON.parse_string(answer.body.get_string_from_utf8()).error}
	return {"map": Compat.bytes_to_floats(answer.body), "tier": answer.headers.get("x-papilla-tier", "")}
