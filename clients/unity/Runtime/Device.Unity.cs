#if UNITY_5_3_OR_NEWER
using UnityEngine.XR;

namespace Papilla
{
    /// <summary>Commands to the motors of Unity's XR controllers.</summary>
    public static class UnityDevices
    {
        /// <summary>Sends the amplitude to the first motor of a controller; false where it has none. A command of 0 stops it.</summary>
        public static bool Vibrate(this InputDevice controller, DeviceCommand command)
        {
            HapticCapabilities can;
            if (!controller.TryGetHapticCapabilities(out can) || !can.supportsImpulse) return false;
            if (command.Amplitude > 0) return controller.SendHapticImpulse(0, command.Amplitude, command.DurationS);
            controller.StopHaptics();
            return true;
        }
    }
}
#endif
