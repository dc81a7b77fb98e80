#include "widgets/views/room/body_part.h"

#include <vtkActor.h>
#include <vtkPolyData.h>
#include <vtkProperty.h>
#include <vtkRenderer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "widgets/views/host/mesh.h"

namespace fieldtrue::widgets {
namespace {

constexpr double kSolidOpacity = 0.55;
constexpr double kRegionOpacity = 0.22;
constexpr int kRingSteps = 64;
constexpr int kWireSteps = 12;
constexpr double kRingThickness = 0.012;  ///< Of the room's diagonal, as the next.
constexpr double kLeastBall = 0.012;
constexpr double kEdgeWidth_px = 2.0;

using Rectangle = std::array<Eigen::Vector3d, 4>;

Rectangle rectangle(const Eigen::Vector3d& center_m, const Eigen::Vector3d& half_u, const Eigen::Vector3d& half_v) {
  return {center_m - half_u - half_v, center_m + half_u - half_v, center_m + half_u + half_v,
          center_m - half_u + half_v};
}

void addFace(Mesh& mesh, const Rectangle& r, const Eigen::Vector3d& normal) {
  mesh.addTriangle(r[0], r[1], r[2], normal);
  mesh.addTriangle(r[0], r[2], r[3], normal);
}

void addEdges(Lines& lines, const Rectangle& r) {
  for (std::size_t i = 0; i < 4; ++i) lines.add(r[i], r[(i + 1) % 4]);
}

/// The part of an endless plane that spans the room.
Rectangle acrossRoom(const BelievedBody& plane, double shift_m, const SceneSpace& space) {
  const Eigen::Vector3d on_plane_m = plane.center_m + shift_m * plane.normal;
  Eigen::Index least = 0;
  plane.normal.cwiseAbs().minCoeff(&least);
  const Eigen::Vector3d u = Eigen::Vector3d::Unit(least).cross(plane.normal).normalized();
  const Eigen::Vector3d v = plane.normal.cross(u);
  const Eigen::Vector3d middle_m = space.center_m() - plane.normal.dot(space.center_m() - on_plane_m) * plane.normal;
  const Eigen::Vector3d half_m = 0.5 * (space.high_m - space.low_m);
  return rectangle(middle_m, half_m.dot(u.cwiseAbs()) * u, half_m.dot(v.cwiseAbs()) * v);
}

void addEllipsoid(Mesh& mesh, const Eigen::Vector3d& center_m, const Eigen::Matrix3d& half_axes_m) {
  constexpr int kAround = 28, kDown = 14;
  const auto unit = [](int i, int j) {
    const double azimuth = 2.0 * std::numbers::pi * i / kAround, polar = std::numbers::pi * j / kDown;
    return Eigen::Vector3d(std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar));
  };
  for (int j = 0; j < kDown; ++j) {
    for (int i = 0; i < kAround; ++i) {
      const Rectangle on_unit = {unit(i, j), unit(i + 1, j), unit(i + 1, j + 1), unit(i, j + 1)};
      Rectangle at;
      for (std::size_t k = 0; k < 4; ++k) at[k] = center_m + half_axes_m * on_unit[k];
      addFace(mesh, at, (half_axes_m * unit(i, j) + half_axes_m * unit(i + 1, j + 1)).normalized());
    }
  }
}

void addRing(Mesh& mesh, const BelievedBody& loop, double thickness_m) {
  const auto [u, v] = across(loop.normal);
  const auto out = [&, u = u, v = v](int i) -> Eigen::Vector3d {
    const double angle = 2.0 * std::numbers::pi * i / kRingSteps;
    return std::cos(angle) * u + std::sin(angle) * v;
  };
  const auto skin = [&](int i, int j) -> Eigen::Vector3d {
    const double angle = 2.0 * std::numbers::pi * j / kWireSteps;
    return std::cos(angle) * out(i) + std::sin(angle) * loop.normal;
  };
  const auto at = [&](int i, int j) -> Eigen::Vector3d {
    return loop.center_m + loop.radius_m * out(i) + thickness_m * skin(i, j);
  };
  for (int i = 0; i < kRingSteps; ++i) {
    for (int j = 0; j < kWireSteps; ++j) {
      const Eigen::Vector3d normal = (skin(i, j) + skin(i + 1, j + 1)).normalized();
      addFace(mesh, {at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)}, normal);
    }
  }
}

/// Half axes no longer than the room, so that a place hardly known does not hide everything.
Eigen::Matrix3d inRoom(Eigen::Matrix3d half_axes_m, const SceneSpace& space) {
  const double least_m = 1e-3 * space.diagonal_m(), most_m = 0.5 * space.diagonal_m();
  for (Eigen::Index i = 0; i < 3; ++i) {
    const double length_m = half_axes_m.col(i).norm();
    if (length_m > most_m) half_axes_m.col(i) *= most_m / length_m;
    if (!(length_m > 0.0)) half_axes_m.col(i) = least_m * Eigen::Vector3d::Unit(i);
  }
  return half_axes_m;
}

}  // namespace

SceneSpace withBodies(SceneSpace space, std::span<const BelievedBody> bodies) {
  const Eigen::Vector3d center_m = space.center_m();
  const Eigen::Vector3d reach_m = Eigen::Vector3d::Constant(space.diagonal_m());
  const Eigen::Vector3d least_m = center_m - reach_m, most_m = center_m + reach_m;
  for (const BelievedBody& body : bodies) {
    Eigen::Vector3d at_m = body.center_m;
    Eigen::Vector3d half_m = Eigen::Vector3d::Constant(body.radius_m);
    if (body.shape == effects::DrawnShape::kPlane) {
      at_m = center_m - body.normal.dot(center_m - body.center_m) * body.normal;
      half_m.setZero();
    } else if (body.shape == effects::DrawnShape::kPlate) {
      half_m.setConstant(0.5 * std::max(body.length_m, body.width_m));
    }
    if (!at_m.allFinite() || !half_m.allFinite()) continue;
    space.low_m = space.low_m.cwiseMin((at_m - half_m).cwiseMax(least_m).cwiseMin(most_m));
    space.high_m = space.high_m.cwiseMax((at_m + half_m).cwiseMin(most_m).cwiseMax(least_m));
  }
  return space;
}

BodyPart::BodyPart(vtkRenderer* renderer)
    : solids_(addSolidActor(renderer)), regions_(addSolidActor(renderer)), outlines_(addFlatActor(renderer)) {
  solids_->GetProperty()->SetOpacity(kSolidOpacity);
  regions_->GetProperty()->SetOpacity(kRegionOpacity);
}

void BodyPart::build(std::span<const BelievedBody> bodies, const SceneSpace& space, const Theme& theme, double ratio) {
  Mesh solids, regions;
  Lines outlines;
  labels_.clear();
  for (const BelievedBody& body : bodies) {
    if (body.shape == effects::DrawnShape::kPlane) {
      const Rectangle face = acrossRoom(body, 0.0, space);
      addFace(regions, face, body.normal);
      for (const auto& end_m : {std::optional<double>(0.0), body.nearest_m, body.farthest_m})
        if (end_m) addEdges(outlines, acrossRoom(body, *end_m, space));
      labels_.push_back({0.5 * (face[0] + face[2]), bodyLabel(body), theme.attention, 0.0});
      continue;
    }
    if (body.shape == effects::DrawnShape::kPlate) {
      const Eigen::Vector3d across_side = body.normal.cross(body.side);
      const Rectangle face =
          rectangle(body.center_m, 0.5 * body.length_m * body.side, 0.5 * body.width_m * across_side);
      addFace(solids, face, body.normal);
      addEdges(outlines, face);
    } else if (body.shape == effects::DrawnShape::kLoop) {
      addRing(solids, body, 0.5 * kRingThickness * space.diagonal_m());
    } else {
      solids.addBall(body.center_m, std::max(body.radius_m, kLeastBall * space.diagonal_m()));
    }
    if (largestHalf_m(body) > 0.0) addEllipsoid(regions, body.center_m, inRoom(body.region_m, space));
    labels_.push_back({body.center_m, bodyLabel(body), theme.attention, body.radius_m});
  }
  for (vtkActor* actor : {solids_.Get(), regions_.Get(), outlines_.Get()})
    actor->GetProperty()->SetColor(rgb(theme.attention).data());
  outlines_->GetProperty()->SetLineWidth(static_cast<float>(kEdgeWidth_px * ratio));
  setShape(solids_, solids.polyData());
  setShape(regions_, regions.polyData());
  setShape(outlines_, outlines.polyData());
}

}  // namespace fieldtrue::widgets
