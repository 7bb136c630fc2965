using System;
using System.Diagnostics;

namespace Papilla
{
    /// <summary>
    /// Writes the intensities of an answer, from 0 to 1, into <paramref name="levels"/>, and returns how many; -1: the answer says
    /// nothing about them.
    /// </summary>
    public delegate int ReadLevels(Answer answer, float[] levels);

    /// <summary>What to send to a device now.</summary>
    public struct DeviceCommand
    {
        /// <summary>Intensity of each actuator, from 0 to 1, finger by finger. The device's own memory: valid until its next command.</summary>
        public float[][] Levels;
        /// <summary>The greatest of them: for a device with one motor, such as a controller.</summary>
        public float Amplitude;
        /// <summary>How long the device may hold it, s: until it would have faded if no other command follows.</summary>
        public float DurationS;
    }

    /// <summary>
    /// What a haptic device takes of a session: intensities from 0 to 1, at most <see cref="MaxHz"/> times a second. It holds what the
    /// last answer of each finger said for <see cref="HoldS"/>, and then fades it to 0 within <see cref="FadeS"/>: so it falls silent when
    /// answers stop, whatever the reason. Feed and poll it on one thread.
    /// </summary>
    public sealed class Device
    {
        /// <summary>Commands a second that the device takes.</summary>
        public readonly double MaxHz;
        public readonly double HoldS, FadeS;
        readonly ReadLevels[] readers;
        readonly Func<double> clockS;
        readonly float[] found = new float[ActuatorsMax];
        readonly float[][] values, levels;
        readonly double[] atS;
        double nextS = double.NegativeInfinity;
        bool isSilent = true;

        /// <summary>Most actuators of a finger.</summary>
        public const int ActuatorsMax = 1024;

        /// <param name="read"><see cref="Force"/>, <see cref="Actuators"/>, or your own, the same for each finger</param>
        /// <param name="clockS">seconds that only rise; null: .NET's stopwatch</param>
        public Device(ReadLevels read, int fingers = 1, double maxHz = 90, double holdS = 0.05, double fadeS = 0.05, Func<double> clockS = null)
            : this(Repeat(read, fingers), maxHz, holdS, fadeS, clockS)
        {
        }

        /// <param name="readers">one for each finger, such as a <see cref="SpikeRate"/></param>
        public Device(ReadLevels[] readers, double maxHz = 90, double holdS = 0.05, double fadeS = 0.05, Func<double> clockS = null)
        {
            this.readers = readers;
            MaxHz = Above("maxHz", maxHz, 0);
            HoldS = Above("holdS", holdS, 0);
            FadeS = Above("fadeS", fadeS, 0);
            this.clockS = clockS ?? StopwatchS;
            values = new float[readers.Length][];
            levels = new float[readers.Length][];
            atS = new double[readers.Length];
            for (int finger = 0; finger < readers.Length; finger++)
            {
                values[finger] = new float[1];
                levels[finger] = new float[1];
                atS[finger] = double.NegativeInfinity;
            }
        }

        /// <summary>
        /// One intensity: the size of the force on the finger, 0 at <paramref name="thresholdN"/> and 1 from <paramref name="fullN"/> on. Of
        /// pressure maps the effect <c>summary</c> has the force.
        /// </summary>
        public static ReadLevels Force(double fullN, double thresholdN = 0)
        {
            double spanN = Above("fullN", fullN, thresholdN);
            return (answer, to) =>
            {
                if (!answer.HasTouch && !answer.HasSummary && !answer.NoContact) throw new NotCarriedException("force", "send objects or gaps, or name the effect 'summary' in the hello");
                double x = answer.Touch.ForceXN, y = answer.Touch.ForceYN, z = answer.Touch.ForceZN;
                double foundN = answer.HasTouch ? Math.Sqrt(x * x + y * y + z * z) : answer.HasSummary ? answer.Summary[0] : 0;
                to[0] = (float)((foundN - thresholdN) / spanN);
                return 1;
            };
        }

        /// <summary>An intensity for each actuator of the effect <c>actuators</c>; <paramref name="full"/> is its <c>max</c>.</summary>
        public static ReadLevels Actuators(double full = 1)
        {
            Above("full", full, 0);
            return (answer, to) =>
            {
                if (answer.ActuatorCount == 0) throw new NotCarriedException("actuators", "name the effect 'actuators' in the hello");
                for (int k = 0; k < answer.ActuatorCount; k++) to[k] = (float)(answer.Actuators[k] / full);
                return answer.ActuatorCount;
            };
        }

        /// <summary>Takes the next answer, of any finger. One without a value (late, lost, refused) counts as none.</summary>
        public void Feed(Answer answer)
        {
            if (answer.Finger < 0 || answer.Finger >= readers.Length) throw new ArgumentOutOfRangeException("answer", "finger " + answer.Finger + " is none of the device, which has " + readers.Length + ", numbered from 0");
            if (answer.Status != Status.Ok) return;
            if (answer.NotTracked)
            {
                atS[answer.Finger] = double.NegativeInfinity;
                return;
            }
            int count = readers[answer.Finger](answer, found);
            // What is no number drives no motor: the finger fades as without an answer.
            for (int k = 0; k < count; k++) if (float.IsNaN(found[k]) || float.IsInfinity(found[k])) return;
            if (count < 0) return;
            if (values[answer.Finger].Length != count)
            {
                values[answer.Finger] = new float[count];
                levels[answer.Finger] = new float[count];
            }
            for (int k = 0; k < count; k++) values[answer.Finger][k] = Math.Min(1, Math.Max(0, found[k]));
            atS[answer.Finger] = clockS();
        }

        /// <summary>Whether a command is due; not before the device takes another, and not as long as it is silent anyway.</summary>
        public bool TryPoll(out DeviceCommand command)
        {
            double nowS = clockS();
            command = default(DeviceCommand);
            if (nowS < nextS) return false;
            command = Now(nowS, HoldS + FadeS);
            if (command.Amplitude == 0 && isSilent) return false;
            isSilent = command.Amplitude == 0;
            nextS = nowS + 1 / MaxHz;
            return true;
        }

        /// <summary>All at 0 from now on, whatever the rate: for the end of a program, or a lost device.</summary>
        public DeviceCommand Stop()
        {
            for (int finger = 0; finger < atS.Length; finger++) atS[finger] = double.NegativeInfinity;
            isSilent = true;
            return Now(clockS(), 0);
        }

        DeviceCommand Now(double nowS, double durationS)
        {
            float most = 0;
            for (int finger = 0; finger < levels.Length; finger++)
            {
                double left = Math.Min(1, Math.Max(0, 1 - (nowS - atS[finger] - HoldS) / FadeS));
                for (int k = 0; k < levels[finger].Length; k++)
                {
                    levels[finger][k] = (float)(values[finger][k] * left);
                    most = Math.Max(most, levels[finger][k]);
                }
            }
            return new DeviceCommand { Levels = levels, Amplitude = most, DurationS = (float)durationS };
        }

        static ReadLevels[] Repeat(ReadLevels read, int fingers)
        {
            var readers = new ReadLevels[fingers];
            for (int finger = 0; finger < fingers; finger++) readers[finger] = read;
            return readers;
        }

        static double StopwatchS()
        {
            return Stopwatch.GetTimestamp() / (double)Stopwatch.Frequency;
        }

        /// <summary>The difference, where it is above 0.</summary>
        internal static double Above(string name, double value, double least)
        {
            if (double.IsInfinity(value) || !(value > least)) throw new ArgumentOutOfRangeException(name, value + " is no number above " + least);
            return value - least;
        }
    }
}
