using System;
using System.Linq;
using Newtonsoft.Json.Linq;

namespace Papilla
{
    /// <summary>
    /// One intensity of the effect <c>spikes</c> for a <see cref="Device"/>: the mean firing rate of the units of some classes. The mean is
    /// over all of them, and most lie outside of a contact: a few Hz are much. Rapidly adapting (<c>ra</c>) and Pacinian (<c>pc</c>) units
    /// fire at changes, as a motor should. Make one for each finger, and hand its <see cref="Read"/> to the device.
    /// </summary>
    public sealed class SpikeRate
    {
        /// <summary>After a longer pause the service computes its last 50 ms.</summary>
        const double SecondsMax = 0.05;
        readonly bool[] isMine;
        readonly int count;
        readonly double fullHz;
        ulong lastUs;
        bool hasLast;

        /// <param name="units">of the session: <c>session.Ready.Json["units"]</c></param>
        /// <param name="fullHz">mean rate of intensity 1</param>
        /// <param name="classes">none: ra and pc</param>
        public SpikeRate(JToken units, double fullHz, params string[] classes)
        {
            if (units == null) throw new NotCarriedException("spikes", "name the effect 'spikes' in the hello");
            this.fullHz = Device.Above("fullHz", fullHz, 0);
            var wanted = classes.Length > 0 ? classes : new[] { "ra", "pc" };
            isMine = units.Select(unit => wanted.Contains((string)unit["class"])).ToArray();
            count = isMine.Count(mine => mine);
            if (count == 0) throw new ArgumentException("no unit of the session is of " + string.Join(", ", wanted), "classes");
        }

        /// <summary>The <see cref="ReadLevels"/> of this finger.</summary>
        public int Read(Answer answer, float[] levels)
        {
            if (answer.Spikes == null) throw new NotCarriedException("spikes", "name the effect 'spikes' in the hello");
            bool isLater = hasLast && answer.ClientTimeUs > lastUs;
            double seconds = isLater ? Math.Min(1e-6 * (answer.ClientTimeUs - lastUs), SecondsMax) : 0;
            lastUs = answer.ClientTimeUs;
            hasLast = true;
            if (!isLater) return -1;
            int fired = 0;
            for (int k = 0; k < answer.SpikeCount; k++) if (isMine[answer.Spikes[k].Unit]) fired++;
            levels[0] = (float)(fired / (count * seconds * fullHz));
            return 1;
        }
    }
}
