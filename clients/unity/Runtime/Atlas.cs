using System;
using System.Collections.Generic;
using Newtonsoft.Json.Linq;

namespace Papilla
{
    /// <summary>
    /// Which point of the finger each pixel is. Skin (where pressure acts) and interface (where SED is read) share triangles; vertex i of
    /// one lies over vertex i of the other. The finger's frame, mm, right-handed: x from the tip to the base, z towards the nail.
    /// Unity has other axes and is left-handed: <see cref="Frames"/> turns vertices and triangles to draw it.
    /// </summary>
    public sealed class Atlas
    {
        const double ReachMm = 5, RadiusAt1NMm = 5.1;

        public readonly string Hash;
        /// <summary>Corners of the triangles, three each.</summary>
        public readonly int[] Triangles;
        /// <summary>x, y, z of each vertex, mm; u, v in pixels, v down.</summary>
        public readonly float[] SkinMm, SkinUvPx, InterfaceMm, InterfaceUvPx;
        public readonly Raster Skin, Interface;
        /// <summary>Where each pixel of the skin lies, mm, and the area it shows, mm2.</summary>
        readonly double[] placesMm, areasMm2, weights;
        readonly int[] tapPixels;
        readonly float[] tapWeights;

        /// <param name="json">what GET /v1/atlas answers</param>
        public Atlas(string json)
        {
            var root = JObject.Parse(json);
            Hash = (string)root["hash"];
            Triangles = Array.ConvertAll(Flat(root["triangles"], 3), value => (int)value);
            SkinMm = Flat(root["skin"]["positions_mm"], 3);
            SkinUvPx = Flat(root["skin"]["uv_px"], 2);
            InterfaceMm = Flat(root["interface"]["positions_mm"], 3);
            InterfaceUvPx = Flat(root["interface"]["uv_px"], 2);
            Skin = new Raster(Triangles, SkinUvPx);
            Interface = new Raster(Triangles, InterfaceUvPx);
            weights = new double[Skin.Pixels.Length];
            placesMm = new double[3 * weights.Length];
            areasMm2 = new double[weights.Length];
            PlacePixels();
            tapPixels = new int[4 * VertexCount];
            tapWeights = new float[4 * VertexCount];
            for (int i = 0; i < VertexCount; i++) Tap(i, InterfaceUvPx[2 * i] - 0.5, InterfaceUvPx[2 * i + 1] - 0.5);
        }

        public int VertexCount { get { return SkinMm.Length / 3; } }

        static float[] Flat(JToken rows, int width)
        {
            var values = new List<float>();
            foreach (var row in rows) for (int k = 0; k < width; k++) values.Add((float)row[k]);
            return values.ToArray();
        }

        /// <summary>Pressures at the skin's vertices (Pa) to a map of 224 x 224, exactly as the server does it.</summary>
        public void PressureMap(float[] vertexPa, float[] map)
        {
            Skin.Rasterise(vertexPa, map);
        }

        /// <summary>
        /// Adds a contact point of a physics engine to a map, as the pressure of Hertz's contact of that force and radius around the nearest
        /// point of the skin (docs/reference/atlas.md). A point more than 5 mm off the skin adds nothing; the map is not cleared before.
        /// </summary>
        public void AddContact(double xMm, double yMm, double zMm, double forceN, double radiusMm, float[] map)
        {
            int nearest = Nearest(xMm, yMm, zMm);
            if (nearest < 0) return;
            double x = placesMm[3 * nearest], y = placesMm[3 * nearest + 1], z = placesMm[3 * nearest + 2], total = 0;
            for (int n = 0; n < weights.Length; n++)
            {
                double part = 1 - Squared(n, x, y, z) / (radiusMm * radiusMm);
                weights[n] = n == nearest ? 1 : part > 0 ? Math.Sqrt(part) : 0;
                total += weights[n] * areasMm2[n];
            }
            for (int n = 0; n < weights.Length; n++) if (weights[n] > 0) map[Skin.Pixels[n]] += (float)(1e6 * forceN * weights[n] / total);
        }

        /// <summary>The same with the finger's own radius on a flat object at that force.</summary>
        public void AddContact(double xMm, double yMm, double zMm, double forceN, float[] map)
        {
            AddContact(xMm, yMm, zMm, forceN, RadiusAt1NMm * Math.Pow(Math.Max(0, forceN), 1 / 3.0), map);
        }

        /// <summary>Force of a pressure map over the undeformed skin, N.</summary>
        public double ForceN(float[] map)
        {
            double sum = 0;
            for (int n = 0; n < areasMm2.Length; n++) sum += 1e-6 * map[Skin.Pixels[n]] * areasMm2[n];
            return sum;
        }

        /// <summary>A map of SED at the vertices, to paint it on the finger.</summary>
        public void AtVertices(float[] map, float[] values)
        {
            for (int i = 0, k = 0; i < values.Length; i++, k += 4)
            {
                values[i] = tapWeights[k] * map[tapPixels[k]] + tapWeights[k + 1] * map[tapPixels[k + 1]]
                    + tapWeights[k + 2] * map[tapPixels[k + 2]] + tapWeights[k + 3] * map[tapPixels[k + 3]];
            }
        }

        double Squared(int n, double x, double y, double z)
        {
            double dx = placesMm[3 * n] - x, dy = placesMm[3 * n + 1] - y, dz = placesMm[3 * n + 2] - z;
            return dx * dx + dy * dy + dz * dz;
        }

        int Nearest(double x, double y, double z)
        {
            int nearest = -1;
            double least = ReachMm * ReachMm;
            for (int n = 0; n < areasMm2.Length; n++)
            {
                double d2 = Squared(n, x, y, z);
                if (d2 > least || d2 == least && nearest >= 0) continue;
                least = d2;
                nearest = n;
            }
            return nearest;
        }

        void PlacePixels()
        {
            for (int n = 0; n < areasMm2.Length; n++)
            {
                int t = 3 * Skin.Triangles[n], a = Triangles[t], b = Triangles[t + 1], c = Triangles[t + 2];
                var area = new double[3];
                for (int k = 0; k < 3; k++)
                {
                    placesMm[3 * n + k] = Skin.Weights[3 * n] * SkinMm[3 * a + k] + Skin.Weights[3 * n + 1] * SkinMm[3 * b + k] + Skin.Weights[3 * n + 2] * SkinMm[3 * c + k];
                    int i = (k + 1) % 3, j = (k + 2) % 3;
                    area[k] = ((double)SkinMm[3 * b + i] - SkinMm[3 * a + i]) * ((double)SkinMm[3 * c + j] - SkinMm[3 * a + j])
                        - ((double)SkinMm[3 * b + j] - SkinMm[3 * a + j]) * ((double)SkinMm[3 * c + i] - SkinMm[3 * a + i]);
                }
                double inMap = ((double)SkinUvPx[2 * b] - SkinUvPx[2 * a]) * ((double)SkinUvPx[2 * c + 1] - SkinUvPx[2 * a + 1])
                    - ((double)SkinUvPx[2 * b + 1] - SkinUvPx[2 * a + 1]) * ((double)SkinUvPx[2 * c] - SkinUvPx[2 * a]);
                areasMm2[n] = Math.Sqrt(area[0] * area[0] + area[1] * area[1] + area[2] * area[2]) / Math.Abs(inMap);
            }
        }

        /// <summary>Bilinear between the pixels around, without those outside the patch; with none inside the nearest of the patch.</summary>
        void Tap(int i, double u, double v)
        {
            int left = (int)Math.Floor(u), top = (int)Math.Floor(v);
            double total = 0;
            for (int corner = 0; corner < 4; corner++)
            {
                int column = left + (corner & 1), row = top + (corner >> 1), pixel = row * Wire.SidePx + column;
                if (column < 0 || row < 0 || column >= Wire.SidePx || row >= Wire.SidePx || !Interface.Mask[pixel]) continue;
                double share = ((corner & 1) != 0 ? u - left : 1 - u + left) * (corner >> 1 != 0 ? v - top : 1 - v + top);
                tapPixels[4 * i + corner] = pixel;
                tapWeights[4 * i + corner] = (float)share;
                total += share;
            }
            if (total > 0)
            {
                for (int k = 4 * i; k < 4 * i + 4; k++) tapWeights[k] = (float)(tapWeights[k] / total);
                return;
            }
            double least = double.MaxValue;
            tapWeights[4 * i] = 1;
            foreach (int pixel in Interface.Pixels)
            {
                double du = pixel % Wire.SidePx - u, dv = pixel / Wire.SidePx - v;
                if (du * du + dv * dv >= least) continue;
                least = du * du + dv * dv;
                tapPixels[4 * i] = pixel;
            }
        }
    }
}
