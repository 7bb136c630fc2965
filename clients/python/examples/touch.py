"""A ball that goes down on a finger, and what pushes back.

python examples/touch.py [URL]
"""

import sys

from papilla import DEFAULT_URL, Session

ball = {"shape": {"shape": "sphere", "radius_mm": 10.0}}
url = sys.argv[1] if len(sys.argv) > 1 else DEFAULT_URL
with Session(url, input="objects", objects=[ball], map=False) as session:
    for step in range(11):
        depth_mm = 0.1 * step
        # The pad's lowest point is at (11.25, 0, -6.53); a ball's origin is its centre.
        answer = session.touch([11.25, 0.0, -16.53 + depth_mm, 0, 0, 0, 1])
        if answer.touch is None:
            # Lost, late or refused: an actuator goes to zero, and the next frame is tried.
            print(f"{depth_mm:.1f} mm: no force, the frame is {answer.status}")
            continue
        print(f"{depth_mm:.1f} mm: {answer.touch.force_n[2]:.3f} N on {answer.touch.area_mm2:.1f} mm2")
