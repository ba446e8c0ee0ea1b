#include "proto/access/principal.h"

#include <gtest/gtest.h>

namespace relmap::access {
namespace {

TEST(Principal, UrisKeepRolesAndNames) {
  EXPECT_EQ(uri_of({Role::kRobot, "cart-1"}), "relmap:robot:cart-1");
  EXPECT_EQ(uri_of({Role::kOperator, "Änne B:/%"}), "relmap:operator:%c3%84nne%20B%3a%2f%25");
  for (const Role role : {Role::kReader, Role::kRobot, Role::kOperator})
    for (const char* name : {"cart-1", "Änne B:/%", "a", "~._-"})
      EXPECT_EQ(principal_of(uri_of({role, name})), (Principal{role, name}));
}

TEST(Principal, OtherUrisNameNobody) {
  for (const char* uri :
       {"", "relmap:", "relmap:robot", "relmap:robot:", "relmap:admin:x", "https:robot:x", "relmap:robot:%4",
        "relmap:robot:%zz", "relmap:robot:%00", "relmap:robot:%ff", "relmap:Robot:x", "relmap:robot:%20"})
    EXPECT_FALSE(principal_of(uri)) << uri;
  EXPECT_FALSE(principal_of("relmap:robot:" + std::string(65, 'x')));
}

}  // namespace
}  // namespace relmap::access
