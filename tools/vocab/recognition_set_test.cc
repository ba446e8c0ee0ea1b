#include "tools/vocab/recognition_set.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "storage/testing/temporary_folder.h"

namespace relmap::vocab {
namespace {

class RecognitionSetTest : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text = "") {
    const std::filesystem::path path = folder_ / name;
    std::filesystem::create_directories(path.parent_path());
    std::ofstream(path) << text;
  }
  storage::TemporaryFolder folder_;
  const std::string root_ = folder_ / ".";
};

TEST_F(RecognitionSetTest, ADriveThatComesBack) {
  for (int i = 1; i <= 24; ++i) write("images/" + std::to_string(i) + ".jpg");
  write("loops_from_gt_bmp.csv", "row_image,col_image,value\n21,1,255\n2,21,255\n21,15,255\n");
  const auto set = load_recognition_set("rtabmap", {root_}).or_throw();
  ASSERT_EQ(set.pictures.size(), 24u);
  EXPECT_TRUE(set.pictures[10].file.ends_with("/11.jpg"));  // by number, not by name
  EXPECT_EQ(set.pictures[20].open, 10u);
  EXPECT_EQ(set.pictures[20].same, (std::vector<std::uint32_t>{0, 1}));  // 15 is recent
  EXPECT_TRUE(set.pictures[21].same.empty());
}

TEST_F(RecognitionSetTest, AFlightTimedByNanoseconds) {
  for (const char* ns : {"1000000000", "9000000000", "11500000000"}) write(std::string("cam0/") + ns + ".jpg");
  write("revisit_pairs_from_gt.csv", "later_ns,earlier_ns\n11500000000,1000000000\n");
  const auto set = load_recognition_set("euroc", {root_}).or_throw();
  EXPECT_EQ(set.pictures[2].open, 1u);
  EXPECT_EQ(set.pictures[2].same, std::vector<std::uint32_t>{0});
}

TEST_F(RecognitionSetTest, QueriesAskForTheFloor) {
  write("dataset.csv",
        "image_path,label,split\nf/hall_frame_000001.jpg,one,gallery\nf/hall_frame_000003.jpg,one,gallery\n"
        "g/hall_frame_000001.jpg,two,gallery\nf/hall_frame_000002.jpg,one,query\n");
  const auto set = load_recognition_set("tower", {root_}).or_throw();
  ASSERT_EQ(set.pictures.size(), 4u);
  EXPECT_FALSE(set.pictures[0].asks);
  EXPECT_EQ(set.pictures[0].frame.session, set.pictures[1].frame.session);
  EXPECT_NE(set.pictures[0].frame.session, set.pictures[2].frame.session);
  EXPECT_FALSE(set.pictures[3].stays);
  EXPECT_EQ(set.pictures[3].same, (std::vector<std::uint32_t>{0, 1}));
}

TEST_F(RecognitionSetTest, QueriesAskForTheAreaOfAFloorAmongMoreFloors) {
  const std::string header = "image_path,label,split,device,lighting,area\n";
  write("a/dataset.csv", header +
                             "hall_frame_000001.jpg,one,gallery,,,hall\nlift_frame_000001.jpg,one,gallery,,,lift\n"
                             "hall_frame_000002.jpg,one,query,,,hall\n");
  write("b/dataset.csv", header + "up_frame_000001.jpg,two,gallery,,,hall\n");
  const auto set = load_recognition_set("tower-area", {folder_ / "a", folder_ / "b"}).or_throw();
  ASSERT_EQ(set.pictures.size(), 4u);
  EXPECT_EQ(set.pictures[2].file, folder_ / "b/up_frame_000001.jpg");
  EXPECT_EQ(set.pictures[3].open, 3u);
  EXPECT_EQ(set.pictures[3].same, std::vector<std::uint32_t>{0});
}

TEST_F(RecognitionSetTest, PhotographsAskForEachOtherAmongOthers) {
  for (const char* name : {"walk/1.jpg", "walk/2.jpg", "walk/3.jpg", "walk/4.jpg", "else/more/1.jpg"}) write(name);
  const auto walk = load_recognition_set("walk", {folder_ / "walk", folder_ / "else"}).or_throw();
  ASSERT_EQ(walk.pictures.size(), 9u);
  EXPECT_EQ(walk.pictures[3].frame, (FrameId{1, 3}));
  EXPECT_EQ(walk.pictures[4].frame, (FrameId{2, 0}));
  EXPECT_EQ(walk.pictures[5].open, 5u);
  EXPECT_EQ(walk.pictures[5].itself, 0u);
  EXPECT_EQ(walk.pictures[5].same, (std::vector<std::uint32_t>{1, 2}));
  EXPECT_EQ(walk.pictures[6].same, (std::vector<std::uint32_t>{0, 2, 3}));
  const auto front = load_recognition_set("front", {folder_ / "walk", folder_ / "else"}).or_throw();
  EXPECT_EQ(front.pictures[3].frame, (FrameId{4, 0}));
  EXPECT_EQ(front.pictures[5].same, (std::vector<std::uint32_t>{1, 2, 3}));
}

TEST_F(RecognitionSetTest, ASimulatedDriveKnowsWhereItStood) {
  std::string poses;
  for (int i = 0; i < 30; ++i) {
    write("image_0/0000" + std::to_string(10 + i) + ".png");
    poses += "1 0 0 " + std::to_string(4 * (i % 20)) + " 0 1 0 0 0 0 1 0\n";
  }
  write("poses.txt", poses);
  const auto set = load_recognition_set("drive", {root_}).or_throw();
  EXPECT_TRUE(set.pictures[19].same.empty());
  EXPECT_EQ(set.pictures[25].same, std::vector<std::uint32_t>{5});
}

TEST_F(RecognitionSetTest, NamesWhatIsWrong) {
  EXPECT_EQ(load_recognition_set("moon", {root_}).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(load_recognition_set("euroc", {root_, root_}).reason(), Reason::INVALID_ARGUMENT);
  EXPECT_EQ(load_recognition_set("walk", {root_}).reason(), Reason::NO_SUCH_FILE);
  EXPECT_EQ(load_recognition_set("rtabmap", {root_}).reason(), Reason::NO_SUCH_FILE);
  write("images/1.jpg");
  EXPECT_EQ(load_recognition_set("rtabmap", {root_}).reason(), Reason::NO_SUCH_FILE);
  write("loops_from_gt_bmp.csv", "row,col\n7,1\n");
  EXPECT_EQ(load_recognition_set("rtabmap", {root_}).reason(), Reason::CORRUPT);
  write("dataset.csv", "image_path,label,split\nf/hall.jpg,one,other\n");
  EXPECT_EQ(load_recognition_set("tower", {root_}).reason(), Reason::CORRUPT);
}

}  // namespace
}  // namespace relmap::vocab
