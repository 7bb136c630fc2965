using System;
using System.Globalization;

namespace Papilla
{
    /// <summary>
    /// Where a service is, as every client takes it (docs/reference/clients/README.md): <c>host</c>, <c>host:port</c>, or a URL of http,
    /// https, ws or wss with a path in front of the service's own.
    /// </summary>
    public sealed class ServerAddress
    {
        const int OwnPort = 7224;
        const string Ways = "write host, host:port, [IPv6]:port or http(s)://host:port/path";
        static readonly char[] Blanks = { ' ', '\t', '\r', '\n', '\f', '\v' };

        readonly bool isSecure;
        string host, portText, path;
        int port;

        /// <summary>Reads an address; throws a PapillaException <c>bad_address</c> that says what to write.</summary>
        public ServerAddress(string text)
        {
            string rest = (text ?? "").Trim(Blanks);
            string why = rest.Length == 0 ? "it is empty" : IsOdd(rest) ? "it holds a blank or another character that no address has" : null;
            port = OwnPort;
            int at = rest.IndexOf("://", StringComparison.Ordinal);
            if (why == null && at >= 0)
            {
                string scheme = rest.Substring(0, at).ToLowerInvariant();
                isSecure = scheme == "https" || scheme == "wss";
                if (!isSecure && scheme != "http" && scheme != "ws") why = "its scheme is none of http, https, ws, wss";
                port = DefaultPort;
                rest = rest.Substring(at + 3);
            }
            why = why ?? Read(rest);
            if (why != null) throw new PapillaException(new Problem("bad_address", "'" + text + "' is no address of a papilla-server: " + why + "; " + Ways));
        }

        int DefaultPort { get { return isSecure ? 443 : 80; } }

        /// <summary>URL of one of the service's paths.</summary>
        public string Http(string of)
        {
            return Url("http", of);
        }

        /// <summary>URL of sessions.</summary>
        public string Session()
        {
            return Url("ws", "/v1/session");
        }

        /// <summary>
        /// The token without blanks and line ends around it, as files have them; null for none. Others inside are a PapillaException
        /// <c>bad_token</c>.
        /// </summary>
        public static string CleanToken(string token)
        {
            string clean = (token ?? "").Trim(Blanks);
            foreach (char c in clean)
            {
                if (c < '!' || c > '~') throw new PapillaException(new Problem("bad_token", "the token holds a blank, a line end or a character that no token has"));
            }
            return clean.Length == 0 ? null : clean;
        }

        /// <summary>Why it is no address, from its host on; null: it is one.</summary>
        string Read(string rest)
        {
            if (rest.IndexOfAny(new[] { '?', '#' }) >= 0) return "nothing can follow a '?' or '#'; a token is an argument of its own";
            int slash = rest.IndexOf('/');
            string authority = slash < 0 ? rest : rest.Substring(0, slash);
            path = rest.Substring(authority.Length).TrimEnd('/');
            if (authority.IndexOf('@') >= 0) return "it holds a user or a password; a token is an argument of its own";
            string why = Split(authority);
            if (why != null || portText == null) return why;
            bool isPort = portText.Length > 0 && portText.Length < 6 && Only(portText, "", false);
            port = isPort ? int.Parse(portText, NumberStyles.None, CultureInfo.InvariantCulture) : 0;
            return port < 1 || port > 65535 ? "its port is no number from 1 to 65535" : null;
        }

        string Split(string authority)
        {
            int colon = authority.IndexOf(':');
            if (authority.Length > 0 && authority[0] == '[')
            {
                const string due = "in brackets stands an IPv6 address, as [::1]:7224";
                int bracket = authority.IndexOf(']');
                if (bracket < 0) return due;
                host = authority.Substring(1, bracket - 1);
                string after = authority.Substring(bracket + 1);
                if (host.Split(':').Length < 3 || !IsIpv6(host) || after.Length > 0 && after[0] != ':') return due;
                if (after.Length > 0) portText = after.Substring(1);
                return null;
            }
            if (colon != authority.LastIndexOf(':')) return "an IPv6 address stands in brackets, as [::1]:7224";
            host = colon < 0 ? authority : authority.Substring(0, colon);
            if (colon >= 0) portText = authority.Substring(colon + 1);
            return host.Length == 0 || !Only(host, "._-", true) ? "its host is missing or has a character that no host has" : null;
        }

        string Url(string scheme, string of)
        {
            string bare = host.IndexOf(':') < 0 ? host : "[" + host + "]";
            string tail = port == DefaultPort ? "" : ":" + port.ToString(CultureInfo.InvariantCulture);
            return scheme + (isSecure ? "s" : "") + "://" + bare + tail + path + of;
        }

        static bool IsOdd(string text)
        {
            foreach (char c in text) if (c < '!' || c > '~' || "\"<>\\^`{|}".IndexOf(c) >= 0) return true;
            return false;
        }

        static bool IsIpv6(string text)
        {
            foreach (char c in text) if ("0123456789abcdefABCDEF:.".IndexOf(c) < 0) return false;
            return true;
        }

        static bool Only(string text, string more, bool isWord)
        {
            foreach (char c in text)
            {
                bool isLetter = c >= 'a' && c <= 'z' || c >= 'A' && c <= 'Z';
                if (!(c >= '0' && c <= '9') && !(isWord && isLetter) && more.IndexOf(c) < 0) return false;
            }
            return true;
        }
    }
}
