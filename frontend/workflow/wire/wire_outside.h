// What relmap-frontend reaches: daemons over LCM and gRPC, and logs of LCM messages, beside what needs neither.
#pragma once

#include "frontend/workflow/outside.h"

namespace relmap::workflow {

Outside wire_outside();

}  // namespace relmap::workflow
