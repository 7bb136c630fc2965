# Generated: run clients/godot/generate, which makes it of clients/godot/godot3/addons/papilla/address.gd. Edit that file, not this one.
# Where a service is, as every client takes it (docs/reference/clients/README.md), and its token.
extends RefCounted

const OWN_PORT = 7224
const WAYS = "write host, host:port, [IPv6]:port or http(s)://host:port/path"
const SECURE = {"http": false, "ws": false, "https": true, "wss": true}
const LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
const DIGITS = "0123456789"
# Of addresses and of tokens, beside letters and digits.
const SIGNS = "!#$%&'()*+,-./:;=?@[]_~"
const OF_TOKENS = "\"<>\\^`{|}"


# Reads `host`, `host:port` or a URL: {fault} is what is wrong, "" where it is one, and then {is_secure, host, port, path}.
static func parse(text):
	var found = {"fault": "", "is_secure": false, "host": "", "port": OWN_PORT, "path": ""}
	var why = _read(stripped(text), found)
	if why != "":
		found.fault = "'%s' is no address of a papilla-server: %s; %s" % [text, why, WAYS]
	return found


# URL of one of the service's paths.
static func http(address, of):
	return _url("http", address, of)


# URL of sessions.
static func session(address):
	return _url("ws", address, "/v1/session")


# Without blanks and line ends around it, as files have them.
static func stripped(text):
	var begin = 0
	var end = text.length()
	while begin < end and _is_blank(text.substr(begin, 1)):
		begin += 1
	while end > begin and _is_blank(text.substr(end - 1, 1)):
		end -= 1
	return text.substr(begin, end - begin)


# Whether a token without blanks around it can be one.
static func is_token(text):
	return _only(text, LETTERS + DIGITS + SIGNS + OF_TOKENS)


static func _is_blank(letter):
	return letter == " " or letter == "\t" or letter == "\r" or letter == "\n" or letter == "\f" or letter == "\v"


static func _only(text, letters):
	for i in text.length():
		if letters.find(text.substr(i, 1)) < 0:
			return false
	return true


static func _url(scheme, address, of):
	var host = "[%s]" % address.host if address.host.find(":") >= 0 else address.host
	var port = "" if address.port == (443 if address.is_secure else 80) else ":%d" % address.port
	return scheme + ("s" if address.is_secure else "") + "://" + host + port + address.path + of


# Why it is no address; "": it is one.
static func _read(text, found):
	if text == "":
		return "it is empty"
	if not _only(text, LETTERS + DIGITS + SIGNS):
		return "it holds a blank or another character that no address has"
	var rest = text
	var at = text.find("://")
	if at >= 0:
		var scheme = text.substr(0, at).to_lower()
		if not SECURE.has(scheme):
			return "its scheme is none of http, https, ws, wss"
		found.is_secure = SECURE[scheme]
		found.port = 443 if found.is_secure else 80
		rest = text.substr(at + 3, text.length())
	if rest.find("?") >= 0 or rest.find("#") >= 0:
		return "nothing can follow a '?' or '#'; a token is an argument of its own"
	var slash = rest.find("/")
	var authority = rest if slash < 0 else rest.substr(0, slash)
	found.path = rest.substr(authority.length(), rest.length()).rstrip("/")
	if authority.find("@") >= 0:
		return "it holds a user or a password; a token is an argument of its own"
	return _split(authority, found)


static func _split(authority, found):
	var colon = authority.find(":")
	if authority.begins_with("["):
		var bracket = authority.find("]")
		found.host = authority.substr(1, max(0, bracket - 1))
		var is_six = found.host.split(":").size() > 2 and _only(found.host, "abcdefABCDEF:." + DIGITS)
		colon = bracket + 1 if bracket + 1 < authority.length() else -1
		if bracket < 0 or not is_six or (colon >= 0 and authority.substr(colon, 1) != ":"):
			return "in brackets stands an IPv6 address, as [::1]:7224"
	elif colon >= 0 and authority.find(":", colon + 1) >= 0:
		return "an IPv6 address stands in brackets, as [::1]:7224"
	else:
		found.host = authority if colon < 0 else authority.substr(0, colon)
		if found.host == "" or not _only(found.host, LETTERS + DIGITS + "._-"):
			return "its host is missing or has a character that no host has"
	if colon < 0:
		return ""
	var port = authority.substr(colon + 1, authority.length())
	var is_number = port != "" and port.length() < 6 and _only(port, DIGITS)
	found.port = int(port) if is_number else 0
	return "" if found.port >= 1 and found.port <= 65535 else "its port is no number from 1 to 65535"
