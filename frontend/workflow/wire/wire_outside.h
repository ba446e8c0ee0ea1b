// The Outside of relmap-frontend: daemons over LCM and gRPC, logs of LCM messages, and the defaults for the rest.
#pragma once

#include "frontend/workflow/outside.h"

namespace relmap::workflow {

Outside wire_outside();

}  // namespace relmap::workflow
