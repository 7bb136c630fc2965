using Papilla;

/// <summary>What the scene Hands holds, without Unity: its objects as the service knows them, and how the finger moves by itself.</summary>
public static class HandsScene
{
    /// <summary>From object to object, and half the height of each, m.</summary>
    public const double PitchM = 0.03;
    public static readonly double[] HalfM = { 0.01, 0.003, 0.003 };

    /// <summary>A ball of rubber, a plate and a bar; SED and displacement come at the vertices of the skin.</summary>
    public static Hello Hello()
    {
        return new Hello
        {
            Objects =
            {
                new TouchObject { Shape = new SphereShape { RadiusMm = 10 }, Material = new TouchMaterial { StiffnessMpaPerMm = 0.05, Friction = 0.5 } },
                new TouchObject { Shape = new PlateShape() },
                new TouchObject { Shape = new CylinderShape() },
            },
            AnswerLayout = SampleLayout.Vertices,
            Displacement = true,
            Effects = { new ShearEnergyEffect() },
        };
    }

    /// <summary>Where the pad presses so deep at this place beside the middle object; from the middle of the objects' tops, m.</summary>
    public static Place Finger(double besideM, double depthM)
    {
        return new Place(besideM, 0.0065 - depthM, 0.01125);
    }

    /// <summary>From object to object in two seconds each, down by 1 mm into it and up again.</summary>
    public static Place FingerAt(double seconds)
    {
        double turn = seconds / 2;
        return Finger(PitchM * ((int)turn % 3 - 1), 0.003 * System.Math.Sin(2 * System.Math.PI * turn - System.Math.PI / 2) - 0.002);
    }
}
