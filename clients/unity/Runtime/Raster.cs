using System;

namespace Papilla
{
    /// <summary>
    /// Vertex values to a map: the table (pixel, triangle, weights), made once by the server's own rule: a pixel belongs to the triangle of
    /// lowest index that holds its centre, edges and corners included. uv are multiples of 1/4096 px, so the test is exact in double.
    /// </summary>
    public sealed class Raster
    {
        /// <summary>Flat index of every pixel of the patch, ascending.</summary>
        public readonly int[] Pixels;
        /// <summary>Triangle of each of them.</summary>
        public readonly int[] Triangles;
        /// <summary>Three weights each, for the triangle's corners.</summary>
        public readonly double[] Weights;
        /// <summary>Whether a pixel is in the patch.</summary>
        public readonly bool[] Mask = new bool[Wire.MapLength];
        readonly int[] corners;

        internal Raster(int[] triangles, float[] uv)
        {
            var owner = new int[Wire.MapLength];
            var weights = new double[3 * Wire.MapLength];
            for (int t = 0; t < triangles.Length / 3; t++) Claim(t, triangles, uv, owner, weights);
            int count = 0;
            foreach (int one in owner) if (one > 0) count++;
            Pixels = new int[count];
            Triangles = new int[count];
            Weights = new double[3 * count];
            corners = new int[3 * count];
            for (int i = 0, n = 0; i < owner.Length; i++)
            {
                if (owner[i] == 0) continue;
                Mask[i] = true;
                Pixels[n] = i;
                Triangles[n] = owner[i] - 1;
                for (int k = 0; k < 3; k++)
                {
                    Weights[3 * n + k] = weights[3 * i + k];
                    corners[3 * n + k] = triangles[3 * Triangles[n] + k];
                }
                n++;
            }
        }

        /// <summary>Gives triangle t the pixels without an owner whose centre lies in it; an owner is stored as t + 1.</summary>
        static void Claim(int t, int[] triangles, float[] uv, int[] owner, double[] weights)
        {
            int a = 2 * triangles[3 * t], b = 2 * triangles[3 * t + 1], c = 2 * triangles[3 * t + 2];
            double au = uv[a], av = uv[a + 1], bu = uv[b], bv = uv[b + 1], cu = uv[c], cv = uv[c + 1];
            double total = Area(au, av, bu, bv, cu, cv);
            double sign = Math.Sign(total);
            int left = Math.Max(0, (int)Math.Floor(Math.Min(au, Math.Min(bu, cu)) - 0.5)), right = Math.Min(Wire.SidePx - 1, (int)Math.Max(au, Math.Max(bu, cu)));
            int top = Math.Max(0, (int)Math.Floor(Math.Min(av, Math.Min(bv, cv)) - 0.5)), low = Math.Min(Wire.SidePx - 1, (int)Math.Max(av, Math.Max(bv, cv)));
            for (int row = top; row <= low; row++)
            {
                for (int column = left; column <= right; column++)
                {
                    int i = row * Wire.SidePx + column;
                    double u = column + 0.5, v = row + 0.5;
                    double wa = Area(bu, bv, cu, cv, u, v), wb = Area(cu, cv, au, av, u, v), wc = Area(au, av, bu, bv, u, v);
                    if (owner[i] != 0 || wa * sign < 0 || wb * sign < 0 || wc * sign < 0) continue;
                    owner[i] = t + 1;
                    weights[3 * i] = wa / total;
                    weights[3 * i + 1] = wb / total;
                    weights[3 * i + 2] = wc / total;
                }
            }
        }

        static double Area(double au, double av, double bu, double bv, double cu, double cv)
        {
            return (bu - au) * (cv - av) - (bv - av) * (cu - au);
        }

        /// <summary>Writes the map of values (one a vertex, linear in each triangle); 0 outside the patch.</summary>
        public void Rasterise(float[] values, float[] map)
        {
            Array.Clear(map, 0, map.Length);
            for (int n = 0, k = 0; n < Pixels.Length; n++, k += 3)
            {
                map[Pixels[n]] = (float)(Weights[k] * values[corners[k]] + Weights[k + 1] * values[corners[k + 1]] + Weights[k + 2] * values[corners[k + 2]]);
            }
        }
    }
}
