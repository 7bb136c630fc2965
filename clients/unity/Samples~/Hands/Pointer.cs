using UnityEngine;

/// <summary>The mouse of whichever input system the project has.</summary>
static class Pointer
{
    /// <summary>Whether the left button is held, and where in the window: 0 to 1 from the left and from below.</summary>
    internal static bool TryHeld(out float x, out float y)
    {
        var at = Vector2.zero;
        bool isHeld = false;
#if PAPILLA_INPUT_SYSTEM && ENABLE_INPUT_SYSTEM
        var mouse = UnityEngine.InputSystem.Mouse.current;
        if (mouse != null)
        {
            at = mouse.position.ReadValue();
            isHeld = mouse.leftButton.isPressed;
        }
#elif ENABLE_LEGACY_INPUT_MANAGER
        at = Input.mousePosition;
        isHeld = Input.GetMouseButton(0);
#endif
        x = at.x / Screen.width;
        y = at.y / Screen.height;
        return isHeld;
    }
}
