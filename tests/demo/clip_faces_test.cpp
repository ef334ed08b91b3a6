// The handles of a clip box: drags of its faces compared with the points that the pointer shows.

#include "clip_faces.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <set>

namespace {

using namespace cumulet::demo;
using cumulet::settings::ClipBox;
using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

constexpr Rectangle window = {20.0, 10.0, 640.0, 480.0};
constexpr ClipBox box = {-1.0, -0.5, -2.0, 1.5, 0.5, 1.0};
constexpr double tolerance = 8.0;

Sight sight_from(const dvec3& eye) {
  cumulet_camera_desc camera{};
  camera.struct_size = sizeof camera;
  for (int i = 0; i < 3; ++i) camera.eye[i] = eye[i];
  camera.fovy_degrees = 40.0;
  return {camera, window};
}

// Turned and stretched, so that units of the box are not those of the world.
dmat4 placed() {
  const dmat4 turned = glm::rotate(glm::translate(dmat4(1.0), dvec3(0.3, -0.2, 0.4)), 0.5, dvec3(0.2, 1.0, 0.1));
  return glm::scale(turned, dvec3(1.5, 0.8, 1.2));
}

std::size_t number_of(const ClipFace& face) { return static_cast<std::size_t>(face.axis) + (face.high ? 3 : 0); }

// The pixel of the center of the box's face, if it were at this coordinate.
dvec2 pixel_of(const ClipFace& face, double coordinate, const Sight& sight) {
  ClipBox moved = box;
  moved.at(number_of(face)) = coordinate;
  return *sight.project(center_of(face, moved, placed()));
}

TEST(ClipFaces, AFaceFollowsThePointer) {
  const dmat4 transform = placed();
  int dragged = 0;
  for (const dvec3& eye : {dvec3(4.0, 5.0, 9.0), dvec3(-7.0, 2.0, 3.0), dvec3(3.0, -8.0, -5.0)}) {
    const Sight sight = sight_from(eye);
    for (const ClipFace& face : clip_faces) {
      const double start = box.at(number_of(face));
      const dvec2 from = pixel_of(face, start, sight);
      if (!can_be_dragged(face, box, transform, sight)) continue;
      EXPECT_EQ(clip_face_at(box, transform, sight, from, tolerance), face) << name_of(face);
      ClipDrag drag(face, box, transform, sight, from);
      const double wanted = start + (face.high ? 0.3 : -0.3);
      ClipBox expected = box;
      expected.at(number_of(face)) = wanted;
      const ClipBox moved = drag.to(sight, pixel_of(face, wanted, sight), false);
      for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(moved.at(i), expected.at(i), 1e-9) << name_of(face);
      const ClipBox back = drag.to(sight, from, false);
      for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(back.at(i), box.at(i), 1e-9) << name_of(face);
      // The steps are 0.1 along x and z and 0.05 along y.
      const double snapped = drag.to(sight, pixel_of(face, wanted + 0.004, sight), true).at(number_of(face));
      EXPECT_NEAR(snapped, wanted, 1e-9);
      // Beyond the opposite face it stops before that.
      const double opposite = box.at((number_of(face) + 3) % 6);
      const ClipBox least = drag.to(sight, pixel_of(face, opposite + (face.high ? -0.2 : 0.2), sight), false);
      EXPECT_NEAR(least.at(number_of(face)), opposite, 0.004);
      EXPECT_LT(least.at(static_cast<std::size_t>(face.axis)), least.at(static_cast<std::size_t>(face.axis) + 3));
      ++dragged;
    }
  }
  EXPECT_GT(dragged, 12);
}

TEST(ClipFaces, AFaceSeenFromItsFrontIsNoHandle) {
  const dmat4 transform(1.0);
  const Sight sight = sight_from({0.25, 0.0, 30.0});
  std::set<std::string> found;
  for (const ClipFace& face : clip_faces) {
    const dvec2 at = *sight.project(center_of(face, box, transform));
    if (const auto hit = clip_face_at(box, transform, sight, at, 2.0)) found.insert(name_of(*hit));
  }
  EXPECT_EQ(found, (std::set<std::string>{"clip X min", "clip X max", "clip Y min", "clip Y max"}));
  EXPECT_FALSE(clip_face_at(box, transform, sight, {21.0, 11.0}, tolerance)) << "far from all";
}

}  // namespace
