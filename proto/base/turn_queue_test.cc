#include "proto/base/turn_queue.h"

#include <gtest/gtest.h>

#include <vector>

namespace relmap {
namespace {

std::vector<int> rest_of(TurnQueue<int>& queue) {
  std::vector<int> rest;
  while (!queue.empty()) {
    const int next = queue.front();
    EXPECT_EQ(queue.pop(), next);
    rest.push_back(next);
  }
  return rest;
}

TEST(TurnQueue, OwnersTakeTurnsAndItemsOfOneKeepTheirOrder) {
  TurnQueue<int> queue;
  for (int i = 0; i < 5; ++i) queue.push("much", i);
  queue.push("little", 10);
  queue.push("some", 20);
  queue.push("some", 21);
  EXPECT_EQ(rest_of(queue), (std::vector<int>{0, 10, 20, 1, 21, 2, 3, 4}));
}

TEST(TurnQueue, WhoComesAgainWaitsForTheOthers) {
  TurnQueue<int> queue;
  queue.push("a", 1);
  queue.push("b", 2);
  EXPECT_EQ(queue.pop(), 1);
  queue.push("a", 3);
  queue.push("c", 4);
  EXPECT_EQ(rest_of(queue), (std::vector<int>{2, 3, 4}));
}

TEST(TurnQueue, WhatIsErasedHasNoTurn) {
  TurnQueue<int> queue;
  for (const int i : {1, 2, 1}) queue.push("a", i);
  queue.push("b", 1);
  queue.erase(1);
  queue.erase(7);
  EXPECT_EQ(rest_of(queue), (std::vector<int>{2}));
}

TEST(TurnQueue, WhoHasMostMakesRoomForWhoHasLess) {
  TurnQueue<int> queue;
  EXPECT_FALSE(queue.make_room("little"));
  for (int i = 0; i < 4; ++i) queue.push("much", i);
  queue.push("little", 10);
  EXPECT_FALSE(queue.make_room("much")) << "he is the one";
  EXPECT_EQ(queue.make_room("little"), 3);
  queue.push("little", 11);
  EXPECT_FALSE(queue.make_room("little")) << "then he had as many";
  EXPECT_EQ(queue.make_room("new"), 2);
  EXPECT_EQ(queue.size(), 4u);
  EXPECT_EQ(rest_of(queue), (std::vector<int>{0, 10, 1, 11}));
  EXPECT_EQ(queue.size(), 0u);
}

}  // namespace
}  // namespace relmap
