// Light conditions of a scene.
#pragma once

#include <optional>
#include <string>

#include "tools/sim/scene.h"

namespace relmap::sim {

enum class Daylight {
  kClear,     // as painted
  kMorning,   // a low sun from one side, warm
  kEvening,   // a low sun from the other, warmer
  kOvercast,  // no sun: all sides alike, cold
  kDusk,      // hardly any light left: a third of the grey values, the noise stays
};

// "clear", "morning", "evening", "overcast", "dusk".
const char* daylight_name(Daylight light);
std::optional<Daylight> daylight_of(const std::string& name);

// Changes the light on each surface by its orientation and its colour: each texture has a colour, and is brighter in
// light of that colour. Moving surfaces stay lit as in clear weather.
void light_scene(Scene& scene, Daylight light);
// Brightness of the whole picture; 1 in clear weather.
double brightness(Daylight light);

}  // namespace relmap::sim
