#include "server/rpc/roles.h"

#include <algorithm>
#include <array>

namespace relmap::rpc {

namespace {

struct Entry {
  std::string_view method;
  Role role;
};

constexpr std::array kTable{
    Entry{"Ingest.Stream", Role::kRobot},          Entry{"Ingest.GetAcknowledgement", Role::kRobot},

    Entry{"Map.Localise", Role::kReader},          Entry{"Map.MatchImage", Role::kReader},
    Entry{"Map.FindRoute", Role::kReader},         Entry{"Map.GetNeighbourhood", Role::kReader},
    Entry{"Map.TransformBetween", Role::kReader},  Entry{"Map.GetFrame", Role::kReader},
    Entry{"Map.ListSessions", Role::kReader},      Entry{"Map.ListEdges", Role::kReader},
    Entry{"Map.ExplainEdge", Role::kReader},       Entry{"Map.GetClosureMatrix", Role::kReader},
    Entry{"Map.GetSkeleton", Role::kReader},       Entry{"Map.SetEdgeState", Role::kOperator},
    Entry{"Map.ProposeEdge", Role::kOperator},     Entry{"Map.SetLabel", Role::kOperator},
    Entry{"Map.ImportGraph", Role::kOperator},     Entry{"Map.FindLabels", Role::kReader},
    Entry{"Map.WatchMap", Role::kReader},          Entry{"Map.ListRobots", Role::kReader},
    Entry{"Map.GetStatus", Role::kReader},         Entry{"Map.Export", Role::kReader},

    Entry{"Admin.Verify", Role::kOperator},        Entry{"Admin.Repair", Role::kOperator},
    Entry{"Admin.Backup", Role::kOperator},        Entry{"Admin.Compact", Role::kOperator},
    Entry{"Admin.Reindex", Role::kOperator},       Entry{"Admin.GetStats", Role::kOperator},
    Entry{"Admin.WaitIdle", Role::kOperator},      Entry{"Admin.Commit", Role::kOperator},
    Entry{"Admin.SetLogLevel", Role::kOperator},   Entry{"Admin.FreezeSession", Role::kOperator},
    Entry{"Admin.DeleteSession", Role::kOperator}, Entry{"Admin.ListAudit", Role::kOperator},
};

}  // namespace

std::optional<Role> required_role(std::string_view method) {
  const auto found = std::find_if(kTable.begin(), kTable.end(), [&](const Entry& e) { return e.method == method; });
  return found == kTable.end() ? std::nullopt : std::optional(found->role);
}

bool is_audited(std::string_view method) { return required_role(method) == Role::kOperator; }

}  // namespace relmap::rpc
