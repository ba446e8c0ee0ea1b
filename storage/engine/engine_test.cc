#include "storage/engine/engine.h"

#include "storage/engine/memory_engine.h"
#include "storage/testing/engine_conformance.h"
#include "storage/testing/fault_engine.h"
#include "storage/testing/forgetful_files.h"

namespace relmap::storage {
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
}  // namespace relmap::storage
