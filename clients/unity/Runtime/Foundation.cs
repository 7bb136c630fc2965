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

        /// <summary>Share of the penetration that the finger took in the last call; a soft object took the rest.</summary>
        public double FingerShare = 1;

        /// <summary>
        /// Pressure (Pa) of each vertex from its penetration (mm; 0 or less where it touches nothing), none above mostPa. objectPaPerMm is
        /// the stiffness of a soft object, a foundation of its own behind the finger's; infinite: rigid.
        /// </summary>
        public void Pressures(float[] penetrationMm, float[] vertexPa, float mostPa = float.MaxValue, double objectPaPerMm = double.PositiveInfinity)
        {
            float deepest = 0;
            foreach (float d in penetrationMm) deepest = Math.Max(deepest, d);
            FingerShare = Share(deepest, objectPaPerMm);
            for (int i = 0; i < vertexPa.Length; i++)
            {
                double d = FingerShare * (penetrationMm[i] - Relief * deepest);
                vertexPa[i] = d > 0 ? (float)Math.Min(mostPa, Stiffness * Math.Pow(d, Exponent)) : 0;
            }
        }

        /// <summary>At the deepest point finger and object press on each other alike.</summary>
        double Share(double deepest, double objectPaPerMm)
        {
            if (deepest <= 0 || double.IsPositiveInfinity(objectPaPerMm)) return 1;
            double low = 0, high = 1;
            for (int step = 0; step < 40; step++)
            {
                double share = (low + high) / 2;
                double excess = Stiffness * Math.Pow(share * (1 - Relief) * deepest, Exponent) - objectPaPerMm * (1 - share) * deepest;
                if (excess > 0) high = share;
                else low = share;
            }
            return (low + high) / 2;
        }
    }
}
