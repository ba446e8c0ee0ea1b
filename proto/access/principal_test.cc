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

TEST(Principal, NamesThatMeanNoCredentialsAreNobodys) {
  for (const char* name : {"relmapd", "local", "anonymous"}) {
    EXPECT_EQ(check_principal_name(name).reason(), Reason::BAD_NAME) << name;
    for (const Role role : {Role::kReader, Role::kRobot, Role::kOperator})
      EXPECT_FALSE(principal_of(uri_of({role, name}))) << name;
  }
  for (const char* name : {"relmapd2", "Local", "cart-1"}) EXPECT_TRUE(check_principal_name(name).ok()) << name;
  EXPECT_EQ(check_principal_name(" ").reason(), Reason::BAD_NAME);
}

}  // namespace
}  // namespace relmap::access
