// Addresses of a service, as every client takes them (docs/reference/clients/README.md), and its token.

import { refusal } from './error.js';

/** The service's port, where an address names neither a port nor a scheme. */
const PORT = 7224;
/** @type {Record<string, string>} */
const SECURE = { http: '', ws: '', https: 's', wss: 's' };
const WAYS = 'write host, host:port, [IPv6]:port or http(s)://host:port/path';

/** Without blanks and line ends around it. @param {string} text */
const stripped = (text) => text.replace(/^[ \t\r\n\f\v]+|[ \t\r\n\f\v]+$/g, '');

/**
 * Where a service is: `http(path)` is the URL of one of its paths, `session` that of sessions.
 * @typedef {{http: (path: string) => string, session: string}} Address
 */

/**
 * Reads `host`, `host:port`, or a URL of http, https, ws or wss. In a page '' is the page's own server, and
 * `/path` a path of that.
 * @param {string} text
 * @returns {Address}
 * @throws {PapillaError} `bad_address`
 */
export function addressOf(text) {
  const given = stripped(text);
  const { origin } = globalThis.location ?? {};
  const isOwn = given === '' || /^\/(?!\/)/.test(given);
  if (isOwn && !origin?.startsWith('http')) throw bad(text, given === '' ? 'it is empty' : 'its host is missing');
  const rest = isOwn ? origin + given : given;
  const { secure, host, port, path } = read(rest, (reason) => bad(text, reason));
  const at = `${host}${port === (secure ? 443 : 80) ? '' : `:${port}`}${path}`;
  return { http: (of) => `http${secure}://${at}${of}`, session: `ws${secure}://${at}/v1/session` };
}

/** @param {string} text @param {string} why */
const bad = (text, why) => refusal('bad_address', `'${text}' is no address of a papilla-server: ${why}; ${WAYS}`);

/** @param {string} text @param {(why: string) => Error} fault */
function read(text, fault) {
  if (/[^!-~]|["<>\\^`{|}]/.test(text)) throw fault('it holds a blank or another character that no address has');
  const [, scheme, rest] = /** @type {RegExpMatchArray} */ (text.match(/^(?:(.*?):\/\/)?(.*)$/));
  const name = scheme?.toLowerCase() ?? 'http';
  const secure = SECURE[name];
  if (!Object.hasOwn(SECURE, name)) throw fault('its scheme is none of http, https, ws, wss');
  if (/[?#]/.test(rest)) throw fault("nothing can follow a '?' or '#'; a token is an argument of its own");
  const authority = rest.split('/', 1)[0];
  if (authority.includes('@')) throw fault('it holds a user or a password; a token is an argument of its own');
  const { host, port } = split(authority, fault);
  const number = port === undefined ? (scheme === undefined ? PORT : secure ? 443 : 80) : /^\d{1,5}$/.test(port) ? Number(port) : 0;
  if (number < 1 || number > 65535) throw fault('its port is no number from 1 to 65535');
  return { secure, host, port: number, path: rest.slice(authority.length).replace(/\/+$/, '') };
}

/** Host, with brackets, and port, if there is one. @param {string} authority @param {(why: string) => Error} fault */
function split(authority, fault) {
  if (authority.startsWith('[')) {
    const found = authority.match(/^(\[[\dA-Fa-f.]*:[\dA-Fa-f.]*:[\dA-Fa-f:.]*\])(?::(.*))?$/);
    if (!found) throw fault('in brackets stands an IPv6 address, as [::1]:7224');
    return { host: found[1], port: found[2] };
  }
  const [host, port, ...more] = authority.split(':');
  if (more.length > 0) throw fault('an IPv6 address stands in brackets, as [::1]:7224');
  if (!/^[\w.-]+$/.test(host)) throw fault('its host is missing or has a character that no host has');
  return { host, port };
}

/**
 * The token without blanks and line ends around it, as files have them.
 * @param {string | undefined} token
 * @throws {PapillaError} `bad_token`: others are inside
 */
export function cleanToken(token) {
  const cleaned = stripped(token ?? '');
  if (/[^!-~]/.test(cleaned)) throw refusal('bad_token', 'the token holds a blank, a line end or a character that no token has');
  return cleaned;
}
