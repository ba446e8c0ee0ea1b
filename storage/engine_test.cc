#include "storage/engine.h"

#include "storage/fault_engine.h"
#include "storage/forgetful_files.h"
#include "storage/memory_engine.h"
#include "storage/testing/engine_conformance.h"

namespace relmap {
namespace {

EngineStore memory_store() { return {make_memory_engine, false}; }

EngineStore fault_store() {
  auto disk = ForgetfulFiles::create(1);
  return {[disk] {
            disk->restart();  // whatever was not durable is gone
            return open_fault_engine(disk).value();
          },
          true};
}

INSTANTIATE_TEST_SUITE_P(InMemory, EngineConformance,
                         ::testing::Values(EngineKind{"Memory", memory_store}, EngineKind{"Fault", fault_store}),
                         [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace relmap
