// Client of Papilla, a service that renders what a fingertip feels: pressure on the skin (Pa) in,
// strain energy density at the dermis-epidermis interface (J/m3) out, 224 x 224 float each.
//   hello.hpp    Hello: what a session asks for
//   session.hpp  Session: many maps over a WebSocket, the latest frame wins
//   http.hpp     sed(): one map; http()
//   atlas.hpp    Atlas: pressure maps from vertices or contact points
//   device.hpp   Device: what a haptic device takes of the answers
//   core.hpp     Core: a session without socket and threads, for engines that bring their own
#pragma once

#include "atlas.hpp"
#include "core.hpp"
#include "device.hpp"
#include "frames.hpp"
#include "hello.hpp"
#include "http.hpp"
#include "session.hpp"
