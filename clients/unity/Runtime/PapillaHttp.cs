using System;
using System.IO;
using System.Net;
using Newtonsoft.Json.Linq;

namespace Papilla
{
    /// <summary>What needs no session: the atlas, and one map at a time. Calls wait; do not make them on a game's main thread.</summary>
    public static class PapillaHttp
    {
        // As long as a request may wait for models that are being loaded.
        const int PatienceMs = 30000;

        /// <summary>The atlas of the server at <paramref name="address"/>; see <see cref="ServerAddress"/>.</summary>
        public static Atlas LoadAtlas(string address, string token = null)
        {
            using (var reader = new StreamReader(Answer(Request(address, "v1/atlas", token)).GetResponseStream())) return new Atlas(reader.ReadToEnd());
        }

        /// <summary>The SED map (J/m3) of a pressure map (Pa), both 224 x 224; a refusal is a PapillaException.</summary>
        public static float[] Post(string address, float[] pressurePa, string tier = null, string token = null)
        {
            var request = Request(address, "v1/sed" + (tier == null ? "" : "?tier=" + Uri.EscapeDataString(tier)), token);
            var body = new byte[4 * pressurePa.Length];
            Buffer.BlockCopy(pressurePa, 0, body, 0, body.Length);
            request.Method = "POST";
            request.ContentType = request.Accept = "application/octet-stream";
            using (var stream = request.GetRequestStream()) stream.Write(body, 0, body.Length);
            using (var memory = new MemoryStream())
            {
                Answer(request).GetResponseStream().CopyTo(memory);
                if (memory.Length != 4 * Wire.MapLength) throw new IOException("a map of " + memory.Length + " bytes");
                var map = new float[Wire.MapLength];
                Buffer.BlockCopy(memory.GetBuffer(), 0, map, 0, 4 * Wire.MapLength);
                return map;
            }
        }

        static HttpWebRequest Request(string address, string path, string token)
        {
            var request = WebRequest.CreateHttp(new ServerAddress(address).Http("/" + path));
            request.ServicePoint.Expect100Continue = false;
            request.Timeout = request.ReadWriteTimeout = PatienceMs;
            string clean = ServerAddress.CleanToken(token);
            if (clean != null) request.Headers["Authorization"] = "Bearer " + clean;
            return request;
        }

        static WebResponse Answer(HttpWebRequest request)
        {
            try
            {
                return request.GetResponse();
            }
            catch (WebException error) when (error.Response != null)
            {
                using (var reader = new StreamReader(error.Response.GetResponseStream()))
                {
                    throw new PapillaException(new Problem((JObject)JObject.Parse(reader.ReadToEnd())["error"]));
                }
            }
        }
    }
}
