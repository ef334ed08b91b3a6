#include "surfaces.hpp"

#include <cmath>
#include <vector>

#include "gltf_writer.hpp"
#include "noise.hpp"
#include "terrain.hpp"

namespace cumulet::scene {

using glm::vec2;
using glm::vec3;

namespace {

constexpr float turn = 6.2831853F;

// Meshes of the tower, one per material. In meters, relative to the center of its base.
struct Tower {
  Mesh concrete, steel, copper, glass, lit, red, white, beacon;
};

vec3 around(float angle, float radius, float height) {
  return {radius * std::cos(angle), height, radius * std::sin(angle)};
}

// Returns the shaft's radius: a flared foot, then nearly straight.
float shaft_radius(float height) { return 2.3F + 3.0F * std::exp(-height / 11.0F); }

// Adds a window in a round wall.
void pane(Mesh& mesh, float angle, float radius, float low, float high, float half_width) {
  const vec3 side = half_width * vec3(-std::sin(angle), 0.0F, std::cos(angle));
  const vec3 a = around(angle, radius, low);
  const vec3 b = around(angle, radius, high);
  mesh.quad(a + side, a - side, b - side, b + side);
}

void add_shaft(Tower& tower) {
  std::vector<vec2> profile{{6.6F, -7.0F}, {6.6F, 0.6F}, {5.9F, 0.9F}};
  for (int ring = 0; ring <= 15; ++ring) {
    const float y = 1.0F + 3.0F * static_cast<float>(ring);
    profile.emplace_back(shaft_radius(y), y);
  }
  tower.concrete.turned(vec3(0.0F), profile, 32);
  // Fins, with columns of windows between them. Some windows of the staircase are lit.
  for (int fin = 0; fin < 8; ++fin) {
    const float angle = turn * (static_cast<float>(fin) + 0.5F) / 8.0F;
    for (int ring = 0; ring < 15; ++ring) {
      const float y = 1.0F + 3.0F * static_cast<float>(ring);
      const float top = y + 3.0F;
      tower.concrete.bar(around(angle, shaft_radius(y), y), around(angle, shaft_radius(top), top), 0.34F);
    }
    for (int storey = 0; storey < 14; ++storey) {
      const float y = 2.6F + 3.1F * static_cast<float>(storey);
      const bool lit = unit(hash({fin, storey, 0}, 77)) < 0.45F;
      pane(lit ? tower.lit : tower.glass, turn * static_cast<float>(fin) / 8.0F, shaft_radius(y) + 0.12F, y, y + 1.5F,
           0.42F);
    }
  }
}

// Adds a round storey of glass between a soffit and a roof: radius of the glass, heights of floor and ceiling.
void add_storey(Tower& tower, float radius, float floor, float ceiling, int panes) {
  const float step = turn / static_cast<float>(panes);
  for (int i = 0; i < panes; ++i) {
    const float angle = step * static_cast<float>(i);
    const vec3 low = around(angle, radius, floor);
    const vec3 high = around(angle, radius - 0.25F, ceiling);
    tower.steel.bar(low, high, 0.09F);
    const vec3 next_low = around(angle + step, radius, floor);
    const vec3 next_high = around(angle + step, radius - 0.25F, ceiling);
    const bool lit = unit(hash({i, panes, 1}, 77)) < 0.4F;
    (lit ? tower.lit : tower.glass).quad(next_low, low, high, next_high);
  }
}

void add_head(Tower& tower) {
  // The soffit, the main deck with its railing, and the copper roof.
  tower.concrete.turned(vec3(0.0F),
                        {{2.3F, 43.0F}, {4.2F, 45.2F}, {8.6F, 47.6F}, {8.9F, 47.8F}, {8.9F, 48.3F}, {7.4F, 48.3F}}, 48);
  add_storey(tower, 7.4F, 48.3F, 51.4F, 36);
  tower.copper.turned(vec3(0.0F), {{7.9F, 51.3F}, {7.9F, 51.7F}, {5.2F, 52.9F}, {4.1F, 53.6F}}, 48);
  add_storey(tower, 4.1F, 53.6F, 55.8F, 20);
  tower.copper.turned(vec3(0.0F),
                      {{4.4F, 55.7F}, {4.4F, 56.0F}, {2.0F, 57.2F}, {1.1F, 58.6F}, {0.9F, 59.6F}, {0.0F, 59.6F}}, 40);
  for (int i = 0; i < 48; ++i) {
    const float angle = turn * static_cast<float>(i) / 48.0F;
    const float next = turn * static_cast<float>(i + 1) / 48.0F;
    tower.steel.bar(around(angle, 8.7F, 48.3F), around(angle, 8.7F, 49.3F), 0.05F);
    tower.steel.bar(around(angle, 8.7F, 49.3F), around(next, 8.7F, 49.3F), 0.06F);
  }
}

// Adds the lattice mast in bands of red and white.
void add_mast(Tower& tower) {
  constexpr int bays = 9;
  const auto corner = [](int bay, int leg) {
    const float h = static_cast<float>(bay) / static_cast<float>(bays);
    return around(turn * (static_cast<float>(leg) + 0.5F) / 4.0F, 1.1F - 0.8F * h, 59.4F + 15.0F * h);
  };
  for (int bay = 0; bay < bays; ++bay) {
    Mesh& paint = bay % 2 == 0 ? tower.red : tower.white;
    for (int leg = 0; leg < 4; ++leg) {
      paint.bar(corner(bay, leg), corner(bay + 1, leg), 0.11F);
      paint.bar(corner(bay, leg), corner(bay + 1, leg + 1), 0.055F);
      paint.bar(corner(bay + 1, leg), corner(bay + 1, leg + 1), 0.055F);
    }
  }
  tower.beacon.turned(vec3(0.0F, 74.4F, 0.0F),
                      {{0.0F, 0.0F}, {0.45F, 0.15F}, {0.55F, 0.55F}, {0.4F, 0.95F}, {0.0F, 1.1F}}, 16);
}

// Adds the station at the foot: two gabled houses and a dome.
void add_station(Tower& tower) {
  const auto cottage = [&](const vec3& at, const vec3& half, float roof) {
    tower.concrete.box(at + vec3(0.0F, half.y - 3.0F, 0.0F), {half.x, half.y + 3.0F, half.z});
    const vec3 eaves = at + vec3(0.0F, 2.0F * half.y, 0.0F);
    const float x = half.x + 0.5F;
    const float z = half.z + 0.6F;
    const vec3 ridge(0.0F, roof, 0.0F);
    tower.copper.quad(eaves + vec3(-x, -0.2F, z), eaves + vec3(x, -0.2F, z), eaves + vec3(x, 0, 0) + ridge,
                      eaves + vec3(-x, 0, 0) + ridge);
    tower.copper.quad(eaves + vec3(x, -0.2F, -z), eaves + vec3(-x, -0.2F, -z), eaves + vec3(-x, 0, 0) + ridge,
                      eaves + vec3(x, 0, 0) + ridge);
    for (const float s : {-1.0F, 1.0F}) {
      const vec3 top = eaves + vec3(s * half.x, roof, 0.0F);
      tower.concrete.quad(eaves + vec3(s * half.x, 0, s * half.z), eaves + vec3(s * half.x, 0, -s * half.z), top, top);
    }
    const int windows = static_cast<int>(half.x / 0.9F);
    for (int i = 0; i < windows; ++i) {
      const float wx = at.x + half.x * ((static_cast<float>(i) + 0.5F) * 2.0F / static_cast<float>(windows) - 1.0F);
      for (int storey = 0; storey < 2; ++storey) {
        const float wy = at.y + 0.9F + 2.6F * static_cast<float>(storey);
        if (wy + 1.3F >= eaves.y) continue;
        const bool lit = unit(hash({i, static_cast<int>(10.0F * wy), 2}, 77)) < 0.75F;
        const float wz = at.z + half.z + 0.06F;
        (lit ? tower.lit : tower.glass)
            .quad({wx - 0.45F, wy, wz}, {wx + 0.45F, wy, wz}, {wx + 0.45F, wy + 1.2F, wz}, {wx - 0.45F, wy + 1.2F, wz});
      }
    }
  };
  cottage({12.0F, 0.0F, 1.0F}, {6.5F, 2.6F, 3.6F}, 3.2F);
  cottage({-10.0F, 0.0F, 2.5F}, {4.2F, 2.4F, 3.0F}, 2.6F);
  // The dome, with its slit.
  const vec3 dome(-16.5F, 0.0F, -1.0F);
  tower.concrete.turned(dome, {{3.1F, -5.0F}, {3.1F, 3.0F}}, 32);
  std::vector<vec2> shell{{3.3F, 3.0F}};
  for (int i = 0; i <= 9; ++i) {
    const float angle = 0.25F * turn * static_cast<float>(i) / 9.0F;
    shell.emplace_back(i == 9 ? 0.0F : 3.3F * std::cos(angle), 3.3F + 3.3F * std::sin(angle));
  }
  tower.steel.turned(dome, shell, 32);
}

// Adds the rotating head: two lenses that face +X and -X, and an antenna below them.
void add_lantern(Mesh& steel, Mesh& analytic_light) {
  steel.box({0.0F, -0.9F, 0.0F}, {0.25F, 0.6F, 2.6F});
  steel.box({0.0F, 0.1F, 0.0F}, {0.7F, 0.5F, 0.5F});
  for (const float s : {-1.0F, 1.0F}) {
    const float x = 0.72F * s;
    analytic_light.quad({x, -0.3F, s * 0.4F}, {x, -0.3F, s * -0.4F}, {x, 0.5F, s * -0.4F}, {x, 0.5F, s * 0.4F});
  }
}

}  // namespace

std::string make_surfaces(std::uint32_t seed) {
  Terrain terrain(seed);
  terrain.level({tower_foot.x - 1.0F, tower_foot.z}, tower_foot.y, 13.0F, 22.0F);

  GltfWriter gltf;
  const Detail detail = make_detail(seed);
  const int colors = gltf.texture("rock", detail.size, detail.color);
  const int bumps = gltf.texture("rock normals", detail.size, detail.normal);

  const int rock = gltf.material("ground", vec3(1.0F), 0.0, 0.95);
  gltf.at(rock).pbrMetallicRoughness.baseColorTexture.index = colors;
  gltf.at(rock).normalTexture.index = bumps;
  const int needles = gltf.material("needles", vec3(1.0F), 0.0, 0.9);
  const int water = gltf.material("water", {0.012F, 0.035F, 0.045F}, 0.0, 0.08);
  gltf.at(water).normalTexture.index = bumps;
  gltf.at(water).normalTexture.scale = 0.06;
  const int concrete = gltf.material("concrete", {0.72F, 0.69F, 0.64F}, 0.0, 0.8);
  const int steel = gltf.material("steel", {0.72F, 0.74F, 0.76F}, 1.0, 0.35);
  const int copper = gltf.material("copper", {0.70F, 0.30F, 0.18F}, 1.0, 0.42);
  const int glass = gltf.material("glass", {0.03F, 0.05F, 0.07F}, 0.0, 0.06);
  const int red = gltf.material("red paint", {0.60F, 0.04F, 0.03F}, 0.0, 0.5);
  const int white = gltf.material("white paint", {0.85F, 0.85F, 0.83F}, 0.0, 0.5);
  const int lit = gltf.glowing("lit windows", {0.2F, 0.18F, 0.15F}, {3.2F, 1.9F, 0.8F});
  const int beacon = gltf.glowing("beacon", {0.3F, 0.02F, 0.02F}, {9.0F, 0.7F, 0.4F});
  const int analytic_light = gltf.glowing("lamp", {0.5F, 0.5F, 0.5F}, {12.0F, 11.0F, 8.0F});

  const Mesh ground = terrain.ground();
  gltf.node("Terrain", -1, gltf.mesh("terrain", {{&ground, rock}}));
  const Mesh forest = terrain.forest();
  if (!forest.index.empty()) gltf.node("Forest", -1, gltf.mesh("forest", {{&forest, needles}}));

  Mesh lake;
  const vec2 high = Terrain::low + Terrain::spacing * static_cast<float>(Terrain::side - 1);
  const float y = Terrain::lake_level;
  lake.quad({Terrain::low.x, y, high.y}, {high.x, y, high.y}, {high.x, y, Terrain::low.y},
            {Terrain::low.x, y, Terrain::low.y});
  for (const vec3& p : lake.position) lake.uv.emplace_back(p.x / 9.0F, p.z / 9.0F);
  gltf.node("Lake", -1, gltf.mesh("lake", {{&lake, water}}));

  Tower tower;
  add_shaft(tower);
  add_head(tower);
  add_mast(tower);
  const int building = gltf.node("Tower", -1,
                                 gltf.mesh("tower", {{&tower.concrete, concrete},
                                                     {&tower.steel, steel},
                                                     {&tower.copper, copper},
                                                     {&tower.glass, glass},
                                                     {&tower.lit, lit},
                                                     {&tower.red, red},
                                                     {&tower.white, white},
                                                     {&tower.beacon, beacon}}),
                                 tower_foot);
  Tower station;
  add_station(station);
  gltf.node("Station", building,
            gltf.mesh("station", {{&station.concrete, concrete},
                                  {&station.steel, steel},
                                  {&station.copper, copper},
                                  {&station.glass, glass},
                                  {&station.lit, lit}}));
  Mesh head;
  Mesh lenses;
  add_lantern(head, lenses);
  const int lantern = gltf.node("Lantern", building, gltf.mesh("lantern", {{&head, steel}, {&lenses, analytic_light}}),
                                {0.0F, 61.4F, 0.0F});
  gltf.spin("Beacon", lantern, 6.0);
  const View view;
  gltf.attach_camera(gltf.node("View", -1, -1, view.eye), view.target, glm::radians(view.fovy_degrees), 16.0 / 9.0);
  return gltf.glb();
}

}  // namespace cumulet::scene
