using System;

namespace Papilla
{
    /// <summary>
    /// Pressure from penetration: every vertex of the undeformed skin has a spring of its own,
    /// <c>p = Stiffness max(0, d - Relief d_max)^Exponent</c>. Constants and their errors against FE: docs/reference/clients/web.md.
    /// </summary>
    public sealed class Foundation
    {
        /// <summary>Pa per mm^Exponent.</summary>
        public double Stiffness = 20090;
        public double Exponent = 0.6;
        /// <summary>Share of the greatest penetration that meets no object: skin that sinks beside the contact.</summary>
        public double Relief = 0.35;

        /// <summary>Pressure (Pa) of each vertex from its penetration (mm; 0 or less where it touches nothing), none above mostPa.</summary>
        public void Pressures(float[] penetrationMm, float[] vertexPa, float mostPa = float.MaxValue)
        {
            float deepest = 0;
            foreach (float d in penetrationMm) deepest = Math.Max(deepest, d);
            for (int i = 0; i < vertexPa.Length; i++)
            {
                double d = penetrationMm[i] - Relief * deepest;
                vertexPa[i] = d > 0 ? (float)Math.Min(mostPa, Stiffness * Math.Pow(d, Exponent)) : 0;
            }
        }
    }
}
