// Manipulator handles in the image: their geometry compared with closed forms, and transforms that result from drags.

#include "gizmo.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <numbers>
#include <random>
#include <vector>

#include "scene_items.hpp"

namespace {

using namespace cumulet::demo;
using glm::dmat4;
using glm::dvec2;
using glm::dvec3;
using glm::dvec4;

constexpr double pi = std::numbers::pi;
constexpr Rectangle window = {20.0, 10.0, 640.0, 480.0};
constexpr double reach = 90.0;
constexpr std::array all = {Handle::x, Handle::y, Handle::z, Handle::yz, Handle::zx, Handle::xy, Handle::free};

cumulet_camera_desc camera(const dvec3& eye, double orthographic_height = 0.0) {
  cumulet_camera_desc desc{};
  desc.struct_size = sizeof desc;
  for (int i = 0; i < 3; ++i) desc.eye[i] = eye[i];
  desc.fovy_degrees = 40.0;
  desc.orthographic_height = orthographic_height;
  return desc;
}

std::vector<Sight> sights() {
  std::vector<Sight> all_of;
  for (const double height : {0.0, 12.0})
    for (const dvec3& eye : {dvec3(4.0, 5.0, 9.0), dvec3(-7.0, 2.0, 3.0), dvec3(3.0, -8.0, -5.0)})
      all_of.emplace_back(camera(eye, height), window);
  return all_of;
}

void expect_near(const dvec3& a, const dvec3& b, double within) { EXPECT_LE(glm::distance(a, b), within); }

TEST(Gizmo, FindsTheNearestPointOnAnAxis) {
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto vector = [&] { return dvec3(normal(random), normal(random), normal(random)); };
  int hits = 0;
  for (int i = 0; i < 200; ++i) {
    const Ray ray{vector(), glm::normalize(vector())};
    const dvec3 point = vector();
    const dvec3 axis = glm::normalize(vector());
    // A numerical search without the formulas.
    const auto distance = [&](double t) {
      const dvec3 at = point + t * axis - ray.origin;
      return glm::length(at - glm::dot(at, ray.direction) * ray.direction);
    };
    double low = -1e3;
    double high = 1e3;
    for (int step = 0; step < 200; ++step) {
      const double a = low + (high - low) / 3.0;
      const double b = high - (high - low) / 3.0;
      (distance(a) < distance(b) ? high : low) = distance(a) < distance(b) ? b : a;
    }
    const bool before = glm::dot(point + low * axis - ray.origin, ray.direction) > 0.0;
    const auto found = nearest_on_axis(ray, point, axis);
    if (std::abs(low) > 900.0) continue;
    ASSERT_EQ(found.has_value(), before) << i;
    if (found) {
      EXPECT_NEAR(*found, low, 1e-5 * std::max(1.0, std::abs(low)));
    }
    hits += before ? 1 : 0;
  }
  EXPECT_GT(hits, 50);
  const Ray ray{{0.0, 0.0, 0.0}, {0.0, 0.0, -1.0}};
  EXPECT_FALSE(nearest_on_axis(ray, {1.0, 0.0, 0.0}, {0.0, 0.0, -1.0})) << "they run alike";
  EXPECT_FALSE(nearest_on_axis(ray, {1.0, 0.0, 5.0}, {1.0, 0.0, 0.0})) << "behind";
  EXPECT_EQ(nearest_on_axis(ray, {1.0, 0.0, -5.0}, {1.0, 0.0, 0.0}), -1.0);
}

TEST(Gizmo, FindsThePlaneHitInFrontOfTheRay) {
  const Ray ray{{1.0, 2.0, 3.0}, glm::normalize(dvec3(0.0, 3.0, -4.0))};
  const auto hit = plane_hit(ray, {0.0, 0.0, -1.0}, {0.0, 0.0, 1.0});
  ASSERT_TRUE(hit);
  expect_near(*hit, {1.0, 5.0, -1.0}, 1e-12);
  EXPECT_FALSE(plane_hit(ray, {0.0, 0.0, 4.0}, {0.0, 0.0, 1.0})) << "behind";
  EXPECT_FALSE(plane_hit(ray, {0.0, 0.0, 0.0}, {1.0, 0.0, 0.0})) << "along it";
}

TEST(Gizmo, RotationsAreRightHanded) {
  EXPECT_NEAR(angle_about({0.0, 0.0, 1.0}, {1.0, 0.0, 5.0}, {0.0, 2.0, -3.0}), pi / 2.0, 1e-12);
  EXPECT_NEAR(angle_about({0.0, 0.0, -1.0}, {1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}), -pi / 2.0, 1e-12);
  EXPECT_NEAR(angle_about({0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}, {1.0, 0.0, 0.0}), pi / 2.0, 1e-12);
}

TEST(Gizmo, SnapStepsAreRoundNumbers) {
  EXPECT_DOUBLE_EQ(round_step(1.0), 1.0);
  EXPECT_DOUBLE_EQ(round_step(0.73), 0.5);
  EXPECT_DOUBLE_EQ(round_step(48.0), 20.0);
  EXPECT_DOUBLE_EQ(round_step(0.0019), 0.001);
  EXPECT_EQ(round_step(0.0), 0.0);
}

TEST(ViewProjection, PixelsAndRaysRoundTrip) {
  for (const Sight& sight : sights()) {
    for (const dvec3& point : {dvec3(0.0), dvec3(1.0, -0.5, 0.3), dvec3(-1.5, 1.0, -1.0)}) {
      const auto pixel = sight.project(point);
      ASSERT_TRUE(pixel);
      const Ray ray = sight.ray(*pixel);
      EXPECT_NEAR(glm::length(ray.direction), 1.0, 1e-12);
      EXPECT_LE(glm::length(glm::cross(point - ray.origin, ray.direction)), 1e-9);
      EXPECT_GT(glm::dot(point - ray.origin, ray.direction), 0.0);
      expect_near(sight.to_eye(point), -ray.direction, 1e-9);
      // Ten pixels to the side have the returned length.
      const dvec3 right = glm::normalize(glm::cross(sight.forward(), dvec3(0.0, 1.0, 0.0)));
      const auto beside = sight.project(point + 10.0 * sight.pixel_at(point) * right);
      ASSERT_TRUE(beside);
      EXPECT_NEAR(beside->x - pixel->x, 10.0, 1e-6);
      EXPECT_NEAR(beside->y, pixel->y, 1e-6);
    }
    const auto target = sight.project({0.0, 0.0, 0.0});
    EXPECT_NEAR(target->x, window.x + 0.5 * window.width, 1e-9);
    EXPECT_NEAR(target->y, window.y + 0.5 * window.height, 1e-9);
    EXPECT_LT(sight.project({0.0, 1.0, 0.0})->y, target->y) << "up is up";
  }
}

TEST(ViewProjection, PointsBehindTheCameraAreHidden) {
  const Sight sight(camera({0.0, 0.0, 5.0}), window);
  EXPECT_FALSE(sight.project({0.0, 0.0, 6.0}));
  EXPECT_FALSE(sight.project({0.0, 0.0, 5.0}));
  EXPECT_FALSE(sight.project({0.0, 1.0, 6.0}, {0.0, 2.0, 9.0}));
  const auto cut = sight.project({0.1, 0.0, 0.0}, {0.1, 0.0, 9.0});
  ASSERT_TRUE(cut);
  EXPECT_NEAR((*cut)[0].x, sight.project({0.1, 0.0, 0.0})->x, 1e-9);
  EXPECT_TRUE(std::isfinite((*cut)[1].x));
  EXPECT_GT((*cut)[1].x, window.x + window.width) << "it leaves the picture at the side where it passes the eye";
}

dvec2 at(const Sight& sight, const dvec3& point) { return sight.project(point).value(); }

TEST(Drag, MovesAsFarAsThePointer) {
  const dvec3 pivot(0.3, -0.2, 0.5);
  for (const Sight& sight : sights()) {
    for (const Handle handle : all) {
      const Gizmo gizmo = gizmo_of(Tool::move, Axes::world, dmat4(1.0), pivot, reach);
      // From one point of the axis or the plane to another.
      dvec3 way(0.7, -0.4, 0.9);
      if (handle == Handle::free) way -= glm::dot(way, sight.forward()) * sight.forward();
      for (int i = 0; i < 3 && handle != Handle::free; ++i)
        if (is_axis(handle) != (axis_of(handle) == i)) way[i] = 0.0;
      Drag drag(gizmo, handle, sight, at(sight, pivot + 0.25 * way));
      const dmat4 moved = drag.to(sight, at(sight, pivot + 1.25 * way), false);
      EXPECT_EQ(glm::dmat3(moved), glm::dmat3(1.0));
      expect_near(dvec3(moved[3]), way, 1e-9);
      // Dragging back restores the start.
      expect_near(dvec3(drag.to(sight, at(sight, pivot + 0.25 * way), false)[3]), dvec3(0.0), 1e-9);
    }
  }
}

TEST(Drag, MovesAlongTheObjectsOwnAxes) {
  const Sight sight(camera({4.0, 5.0, 9.0}), window);
  const dmat4 transform = glm::rotate(dmat4(1.0), 0.6, glm::normalize(dvec3(1.0, 2.0, -1.0))) *
                          glm::scale(dmat4(1.0), dvec3(2.0, 3.0, 0.5));
  const Gizmo gizmo = gizmo_of(Tool::move, Axes::local, transform, dvec3(0.0), reach);
  const dvec3 axis = glm::normalize(dvec3(transform[1]));
  Drag drag(gizmo, Handle::y, sight, at(sight, dvec3(0.0)));
  expect_near(dvec3(drag.to(sight, at(sight, 1.5 * axis), false)[3]), 1.5 * axis, 1e-9);
  EXPECT_EQ(drag.label(), "Y 1.5");
}

TEST(Drag, SnapsToRoundSteps) {
  const Sight sight(camera({4.0, 5.0, 9.0}), window);
  const Gizmo gizmo = gizmo_of(Tool::move, Axes::world, dmat4(1.0), dvec3(0.0), reach);
  const double step = round_step(0.1 * reach * sight.pixel_at(dvec3(0.0)));
  EXPECT_GT(step, 0.0);
  Drag drag(gizmo, Handle::xy, sight, at(sight, dvec3(0.0)));
  const dvec3 moved(drag.to(sight, at(sight, {10.4 * step, -3.6 * step, 0.0}), true)[3]);
  expect_near(moved, {10.0 * step, -4.0 * step, 0.0}, 1e-9);
  // Releasing Ctrl ends the snapping.
  expect_near(dvec3(drag.to(sight, at(sight, {10.4 * step, -3.6 * step, 0.0}), false)[3]),
              {10.4 * step, -3.6 * step, 0.0}, 1e-9);
}

TEST(Drag, RotatesWithThePointer) {
  const dvec3 pivot(0.3, -0.2, 0.5);
  for (const Sight& sight : sights()) {
    for (const Handle handle : {Handle::x, Handle::y, Handle::z, Handle::free}) {
      const Gizmo gizmo = gizmo_of(Tool::rotate, Axes::world, dmat4(1.0), pivot, reach);
      const bool is_free = handle == Handle::free;
      const dvec3 axis = is_free ? sight.to_eye(pivot) : gizmo.axes[axis_of(handle)];
      if (std::abs(glm::dot(axis, sight.to_eye(pivot))) < 0.2) continue;
      const dvec3 a = glm::normalize(glm::cross(axis, dvec3(0.3, 0.8, 0.5)));
      const dvec3 b = glm::cross(axis, a);
      const auto pixel = [&](double angle) { return at(sight, pivot + std::cos(angle) * a + std::sin(angle) * b); };
      Drag drag(gizmo, handle, sight, pixel(0.4));
      // One and a half turns.
      dmat4 turned(1.0);
      for (int i = 1; i <= 30; ++i) turned = drag.to(sight, pixel(0.4 + 0.1 * i * pi), false);
      EXPECT_EQ(drag.label(), "540.0°");
      for (const dvec3& point : {dvec3(1.0, 2.0, 3.0), dvec3(-1.0, 0.5, 0.0)}) {
        const dmat4 want = glm::translate(dmat4(1.0), pivot) * glm::rotate(dmat4(1.0), 3.0 * pi, axis) *
                           glm::translate(dmat4(1.0), -pivot);
        expect_near(dvec3(turned * dvec4(point, 1.0)), dvec3(want * dvec4(point, 1.0)), 1e-7);
      }
      // Steps of 15 degrees.
      static_cast<void>(drag.to(sight, pixel(0.4 + 3.0 * pi + 0.1), true));
      EXPECT_EQ(drag.label(), "540.0°");
      static_cast<void>(drag.to(sight, pixel(0.4 + 3.0 * pi + 0.2), true));
      EXPECT_EQ(drag.label(), "555.0°");
    }
  }
}

// If the ring is seen edge-on, its plane is useless: the drag follows the tangent, and one handle length is one radian.
TEST(Drag, RotatesARingSeenEdgeOn) {
  for (const double height : {0.0, 12.0}) {
    const Sight sight(camera({0.0, 0.0, 9.0}, height), window);
    const Gizmo gizmo = gizmo_of(Tool::rotate, Axes::world, dmat4(1.0), dvec3(0.0), reach);
    const dvec2 from = at(sight, dvec3(0.0));
    Drag drag(gizmo, Handle::y, sight, from);
    const dmat4 turned = drag.to(sight, from + dvec2(reach, 0.0), false);
    // The part nearest to the eye moves to the right with the pointer.
    const dvec3 front(turned * dvec4(0.0, 0.0, 1.0, 1.0));
    expect_near(front, {std::sin(1.0), 0.0, std::cos(1.0)}, 1e-3);
    Drag other(gizmo, Handle::x, sight, from);
    const dvec3 up(other.to(sight, from - dvec2(0.0, 0.5 * reach), false) * dvec4(0.0, 0.0, 1.0, 1.0));
    expect_near(up, {0.0, std::sin(0.5), std::cos(0.5)}, 1e-3);
  }
}

TEST(Drag, ScalesAlongTheObjectsOwnAxes) {
  const dvec3 pivot(0.3, -0.2, 0.5);
  const dmat4 transform = glm::translate(dmat4(1.0), pivot) *
                          glm::rotate(dmat4(1.0), 0.6, glm::normalize(dvec3(1.0, 2.0, -1.0))) *
                          glm::scale(dmat4(1.0), dvec3(2.0, 3.0, 0.5));
  for (const Sight& sight : sights()) {
    for (const Axes axes : {Axes::world, Axes::local}) {
      const Gizmo gizmo = gizmo_of(Tool::scale, axes, transform, pivot, reach);
      for (int i = 0; i < 3; ++i) {
        const dvec3 axis = glm::normalize(dvec3(transform[i]));
        if (std::abs(glm::dot(axis, sight.to_eye(pivot))) > 0.95) continue;
        Drag drag(gizmo, static_cast<Handle>(i), sight, at(sight, pivot + axis));
        const dmat4 changed = drag.to(sight, at(sight, pivot + 1.75 * axis), false) * transform;
        dvec3 scale(1.0);
        scale[i] = 1.75;
        const dmat4 want = transform * glm::scale(dmat4(1.0), scale);
        for (int column = 0; column < 4; ++column) expect_near(dvec3(changed[column]), dvec3(want[column]), 1e-9);
        EXPECT_EQ(drag.label(), "1.75 x");
        // Dragging through the center and beyond only makes it small; it is not mirrored.
        const dmat4 small = drag.to(sight, at(sight, pivot - 0.5 * axis), false) * transform;
        EXPECT_NEAR(glm::length(dvec3(small[i])), 0.01 * glm::length(dvec3(transform[i])), 1e-9);
        EXPECT_GT(glm::determinant(small), 0.0);
        static_cast<void>(drag.to(sight, at(sight, pivot + 1.76 * axis), true));
        EXPECT_EQ(drag.label(), "1.8 x");
      }
    }
    Drag alike(gizmo_of(Tool::scale, Axes::world, transform, pivot, reach), Handle::free, sight, {300.0, 200.0});
    const dmat4 twice = alike.to(sight, dvec2(300.0 + 2.0 * std::log(2.0) * reach, 200.0), false) * transform;
    for (int i = 0; i < 3; ++i) expect_near(dvec3(twice[i]), 2.0 * dvec3(transform[i]), 1e-9);
    expect_near(dvec3(twice[3]), pivot, 1e-9);
  }
}

// For any drag on the screen and beyond, the transform is finite, not mirrored, and not far away.
TEST(Drag, TransformStaysValidForAnyDrag) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-3000.0, 4000.0);
  const dmat4 transform = glm::rotate(dmat4(1.0), 0.6, glm::normalize(dvec3(1.0, 2.0, -1.0)));
  std::vector<Sight> all_of = sights();
  // Its axis passes close to the eye.
  all_of.emplace_back(camera({0.2, 0.1, 3.0}), window);
  for (const Sight& sight : all_of) {
    for (const Tool tool : {Tool::move, Tool::rotate, Tool::scale}) {
      for (const Handle handle : all) {
        for (const dvec3& pivot : {dvec3(0.0), dvec3(0.5, -0.3, 0.1)}) {
          const Gizmo gizmo = gizmo_of(tool, Axes::local, transform, pivot, reach);
          Drag drag(gizmo, handle, sight, at(sight, pivot) + dvec2(13.0, 7.0));
          for (int i = 0; i < 100; ++i) {
            const dmat4 now = drag.to(sight, {anywhere(random), anywhere(random)}, i % 3 == 0);
            for (int column = 0; column < 4; ++column)
              ASSERT_TRUE(std::isfinite(glm::length(now[column]))) << static_cast<int>(handle);
            ASSERT_GT(glm::determinant(now), 0.0);
            ASSERT_LT(glm::distance(dvec3(now * dvec4(pivot, 1.0)), pivot), 1e5);
            ASSERT_FALSE(drag.label().empty());
          }
        }
      }
    }
  }
}

// An axis that points towards the eye is dragged past it: the object stays at its last position.
TEST(Drag, DoesNotMoveIfTheNearestPointIsBehindTheCamera) {
  const Sight sight(camera({0.6, 0.4, 5.0}), window);
  const Gizmo gizmo = gizmo_of(Tool::move, Axes::world, dmat4(1.0), dvec3(0.0), reach);
  Drag drag(gizmo, Handle::z, sight, at(sight, {0.0, 0.0, 0.5}));
  const dmat4 last = drag.to(sight, at(sight, {0.0, 0.0, 2.5}), false);
  expect_near(dvec3(last[3]), {0.0, 0.0, 2.0}, 1e-9);
  // Beyond the axis' vanishing point.
  const dvec2 vanishes = at(sight, {0.0, 0.0, -1e7});
  const dvec2 beyond = vanishes + 3.0 * (vanishes - at(sight, dvec3(0.0)));
  EXPECT_EQ(drag.to(sight, beyond, false), last);
  EXPECT_EQ(drag.to(sight, vanishes, false), last) << "and at that point";
}

TEST(Handles, ArePickedAtTheirPosition) {
  for (const Sight& sight : sights()) {
    for (const Tool tool : {Tool::move, Tool::rotate, Tool::scale}) {
      const Gizmo gizmo = gizmo_of(tool, Axes::world, dmat4(1.0), dvec3(0.2, 0.1, -0.3), reach);
      int there = 0;
      for (const Handle handle : all) {
        const std::vector<dvec2> shape = shape_of(gizmo, handle, sight);
        if (shape.empty()) continue;
        ++there;
        dvec2 grasp(0.0);
        if (tool != Tool::rotate && is_axis(handle))
          grasp = glm::mix(shape[0], shape[1], 0.9);
        else if (tool == Tool::rotate)
          grasp = shape[1];  // where no other handle crosses it
        else
          for (const dvec2& point : shape) grasp += point / static_cast<double>(shape.size());
        EXPECT_EQ(handle_at(gizmo, sight, grasp, 8.0), handle) << static_cast<int>(handle);
      }
      EXPECT_GE(there, 4);
      EXPECT_FALSE(handle_at(gizmo, sight, at(sight, gizmo.pivot) + dvec2(3.0 * reach, 0.0), 8.0));
    }
    EXPECT_FALSE(
        handle_at(gizmo_of(Tool::none, Axes::world, dmat4(1.0), dvec3(0.0), reach), sight, at(sight, dvec3(0.0)), 8.0));
  }
}

TEST(Handles, HaveConstantScreenSize) {
  for (const double distance : {2.0, 20.0, 2000.0}) {
    const Sight sight(camera({0.0, 0.0, distance}), window);
    const Gizmo gizmo = gizmo_of(Tool::move, Axes::world, dmat4(1.0), dvec3(0.0), reach);
    const auto x = shape_of(gizmo, Handle::x, sight);
    ASSERT_EQ(x.size(), 2u);
    EXPECT_NEAR(glm::distance(x[0], x[1]), reach, 1e-6);
    EXPECT_TRUE(shape_of(gizmo, Handle::z, sight).empty()) << "it points at the eye";
    EXPECT_TRUE(shape_of(gizmo, Handle::yz, sight).empty()) << "it is seen from its edge";
    EXPECT_EQ(shape_of(gizmo, Handle::xy, sight).size(), 4u);
  }
  const Sight sight(camera({0.0, 0.0, 5.0}), window);
  for (const Tool tool : {Tool::move, Tool::rotate, Tool::scale})
    for (const Handle handle : all)
      EXPECT_TRUE(shape_of(gizmo_of(tool, Axes::world, dmat4(1.0), {0.0, 0.0, 7.0}, reach), handle, sight).empty())
          << "behind the eye";
}

SceneOptions scene_of_all() {
  SceneOptions scene;
  scene.volume = "a.vdb";
  scene.others.resize(1);
  scene.others[0].volume = "b.vdb";
  scene.others[0].transforms.resize(2);
  for (auto& transform : scene.others[0].transforms) transform[0] = transform[5] = transform[10] = transform[15] = 1.0;
  scene.models.push_back({"c.glb"});
  for (const cumulet_light_kind kind : {CUMULET_LIGHT_DISTANT, CUMULET_LIGHT_RECT, CUMULET_LIGHT_POINT}) {
    scene.analytic_lights.emplace_back().struct_size = sizeof(cumulet_light_desc);
    scene.analytic_lights.back().kind = kind;
    scene.analytic_lights.back().width = 2.0;
    scene.analytic_lights.back().height = 4.0;
  }
  return scene;
}

TEST(Items, AreTheObjectsWithAPosition) {
  const SceneOptions scene = scene_of_all();
  const std::vector<Item> items = items_of(scene);
  std::vector<std::string> names;
  for (const Item& item : items) names.push_back(row_text(scene, item));
  EXPECT_EQ(names, (std::vector<std::string>{"a.vdb", "b.vdb, instance 1", "b.vdb, instance 2", "c.glb",
                                             "Rectangle light 2", "Point light 3"}));
  EXPECT_TRUE(items_of(SceneOptions()).empty());
  EXPECT_FALSE(transform_of(scene, {Item::Kind::analytic_light, 0, 0})) << "a sun stands nowhere";
  EXPECT_FALSE(transform_of(scene, {Item::Kind::volume, 2, 0}));
  EXPECT_FALSE(transform_of(scene, {Item::Kind::volume, 1, 2}));
}

TEST(Items, AreRemovedAndDuplicated) {
  SceneOptions scene = scene_of_all();
  const std::size_t count = listed_items(scene).size();
  const Item instance{Item::Kind::volume, 1, 1};
  EXPECT_EQ(duplicate_item(scene, instance), (Item{Item::Kind::volume, 1, 2}));
  EXPECT_EQ(scene.others[0].transforms.size(), 3u);
  remove_item(scene, instance);
  EXPECT_EQ(scene.others[0].transforms.size(), 2u);
  EXPECT_EQ(duplicate_item(scene, {Item::Kind::volume, 0, 0}), (Item{Item::Kind::volume, 1, 0}));
  ASSERT_EQ(scene.others.size(), 2u);
  EXPECT_EQ(scene.others[0].volume, "a.vdb");
  EXPECT_EQ(listed_items(scene).size(), count + 1);
  remove_item(scene, {Item::Kind::volume, 0, 0});
  EXPECT_TRUE(scene.volume.empty());
  EXPECT_EQ(duplicate_item(scene, {Item::Kind::model, 0, 0}), (Item{Item::Kind::model, 1, 0}));
  EXPECT_EQ(scene.models[1].file, "c.glb");
  remove_item(scene, {Item::Kind::analytic_light, 0, 0});
  EXPECT_EQ(scene.analytic_lights.size(), 2u);
  EXPECT_EQ(visibility_of(scene, {Item::Kind::analytic_light, 0, 0}), nullptr);
}

TEST(Items, TransformsRoundTrip) {
  const SceneOptions before = scene_of_all();
  const dmat4 change = glm::translate(dmat4(1.0), dvec3(1.0, 2.0, 3.0)) *
                       glm::rotate(dmat4(1.0), 0.7, glm::normalize(dvec3(1.0, 1.0, 0.0)));
  for (const Item& item : items_of(before)) {
    SceneOptions scene = before;
    const dmat4 transform = change * transform_of(scene, item).value();
    set_transform(scene, item, transform);
    const dmat4 now = transform_of(scene, item).value();
    // A point light has no orientation.
    for (int column = item == Item{Item::Kind::analytic_light, 2, 0} ? 3 : 0; column < 4; ++column)
      expect_near(dvec3(now[column]), dvec3(transform[column]), 1e-12);
    for (const Item& other : items_of(before)) {
      if (other == item) continue;
      EXPECT_EQ(transform_of(scene, other), transform_of(before, other));
    }
    restore_transform(scene, item, before);
    EXPECT_TRUE(same_scene(scene, before)) << "to the letter";
  }
}

TEST(Items, ScaledLightKeepsItsOtherSettings) {
  const Item item{Item::Kind::analytic_light, 1, 0};
  SceneOptions scene = scene_of_all();
  const dmat4 transform = transform_of(scene, item).value();
  expect_near(dvec3(transform[2]), {0.0, -1.0, 0.0}, 1e-15);
  set_transform(scene, item, glm::translate(dmat4(1.0), dvec3(0.0, 5.0, 0.0)) * transform);
  EXPECT_EQ(scene.analytic_lights[1].position[1], 5.0);
  EXPECT_EQ(scene.analytic_lights[1].direction[1], 0.0) << "down, as it was";
  set_transform(scene, item, transform_of(scene, item).value() * glm::scale(dmat4(1.0), dvec3(3.0, 0.5, 7.0)));
  EXPECT_DOUBLE_EQ(scene.analytic_lights[1].width, 6.0);
  EXPECT_DOUBLE_EQ(scene.analytic_lights[1].height, 2.0);
  expect_near(dvec3(transform_of(scene, item).value()[2]), {0.0, -1.0, 0.0}, 1e-12);
}

TEST(Items, SelectionFollowsRemovals) {
  std::optional<Item> chosen = Item{Item::Kind::model, 2, 0};
  forget(chosen, Item::Kind::volume, 0);
  forget(chosen, Item::Kind::model, 3);
  EXPECT_EQ(chosen->index, 2u);
  forget(chosen, Item::Kind::model, 0);
  EXPECT_EQ(chosen->index, 1u);
  forget(chosen, Item::Kind::model, 1);
  EXPECT_FALSE(chosen);
}

TEST(Items, RotateAboutTheirCenter) {
  const SceneOptions scene = scene_of_all();
  Boxes boxes;
  boxes.volumes.emplace_back(VolumeFile{.volume = "a.vdb"}, Box{{0.0, 2.0, 4.0}, {2.0, 4.0, 8.0}});
  const Item item{Item::Kind::volume, 0, 0};
  const auto box = box_of(scene, boxes, item);
  ASSERT_TRUE(box);
  expect_near(pivot_of(glm::scale(dmat4(1.0), dvec3(2.0)), box), {2.0, 6.0, 12.0}, 1e-12);
  EXPECT_FALSE(box_of(scene, boxes, {Item::Kind::model, 0, 0}));
  expect_near(pivot_of(glm::translate(dmat4(1.0), dvec3(1.0)), std::nullopt), dvec3(1.0), 1e-12);
}

}  // namespace
