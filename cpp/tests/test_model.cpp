#include <stdexcept>

#include "peridem/errors.h"
#include "support.h"

using namespace peridem;
using namespace peridem::test;

namespace {

constexpr Real h = 1e-3;

// Powers of two for the time step and the density, so that hand-made sums do not round.
ModelDeck smallDeck(TimeScheme scheme = TimeScheme::central_difference) {
  MaterialDeck m = material(MaterialType::pd_state, 3 * h);
  m.density = 1024;
  ModelDeck deck = oneBody(quadGrid(4, 4, h), m);
  deck.time_scheme = scheme;
  deck.final_time = 1.0;
  deck.time_steps = 1 << 20;
  return deck;
}

// Two bodies of one zone, `gap` apart.
ModelDeck pairDeck(Real gap, Index n = 5) {
  ModelDeck deck = oneZone(quadGrid(n, n, h), material(MaterialType::pd_state, 3 * h));
  const Real side = (n - 1) * h;
  deck.bodies = {bodyAt(Vec3::Zero()), bodyAt(Vec3(side + gap, 0.3 * h, 0))};
  deck.contacts = {contact(0.95 * h, 1e20)};
  deck.final_time = 1e-3;
  deck.time_steps = 10000;  // dt = 1e-7, far below the stable step
  return deck;
}

DisplacementSet moveX(const Particle& body, Real speed) {
  DisplacementSet set;
  for (Index i = body.start; i < body.stop; ++i) set.nodes.push_back(i);
  set.amplitude.assign(set.nodes.size(), speed);
  set.directions = direction_x;
  set.time_function = {TimeFunctionType::linear, {speed}};
  return set;
}

ForceSet growingForce(std::size_t n, Real amplitude) {
  ForceSet set;
  for (std::size_t i = 0; i < n; ++i) set.nodes.push_back(static_cast<Index>(i));
  set.amplitude.assign(n, amplitude);
  set.directions = direction_x;
  set.time_function = {TimeFunctionType::linear, {1}};
  return set;
}

}  // namespace

TEST_CASE("model: bodies are placed by scale, rotation and site") {
  ModelDeck deck = oneZone(quadGrid(3, 2, 1.0), material(MaterialType::pd_state, 3));
  deck.zones[0].bounding_radius = 1.5;
  deck.zones[0].center = Vec3(1, 0.5, 0);
  BodyDeck body = bodyAt(Vec3(10, 20, 30));
  body.scale = 2;
  body.angle = pi / 2;
  deck.bodies = {bodyAt(Vec3::Zero()), body};
  deck.contacts = {contact(0.5, 1)};
  const DEMModel model(deck, 1);
  const State& state = model.state();
  const Particle& p = model.particles()[1];
  CHECK(p.start == 6);
  CHECK(p.stop == 12);
  CHECK(p.center_node == 11);  // (1, 0.5) is the last node of the mesh
  CHECK(p.bounding_radius == 3);
  CHECK(relativeError(p.mesh_size, 2) < 20 * epsilon);
  CHECK(relativeError(p.volume, 8) < 20 * epsilon);  // 2 x 1, scaled in two directions
  CHECK(relativeError(state.volume[6], 1) < 20 * epsilon);
  CHECK(relativeError(state.volume[7], 2) < 20 * epsilon);
  // (x, y) -> (10 - 2 y, 20 + 2 x, 30); coordinates of size 30 round at 1e-14
  CHECK((state.x_ref[6] - Vec3(11, 18, 30)).norm() < 1e-14);
  CHECK((state.x_ref[11] - Vec3(9, 22, 30)).norm() < 1e-14);
  CHECK(state.x == state.x_ref);
  for (std::size_t i = 0; i < 12; ++i) {
    CHECK(state.particle_id[i] == (i < 6 ? 0 : 1));
    CHECK(state.zone_id[i] == 0);
    CHECK(state.density[i] == 1200);
  }
}

TEST_CASE("model: volumes of 3D bodies scale with the cube") {
  ModelDeck deck = oneZone(tetraGrid(3, 1.0), material(MaterialType::pd_state, 3), 3);
  deck.bodies = {bodyAt(Vec3::Zero())};
  deck.bodies[0].scale = 0.5;
  CHECK(relativeError(DEMModel(deck, 1).particles()[0].volume, 1) < 100 * epsilon);
}

TEST_CASE("model: given nodal volumes win over those of the cells") {
  ModelDeck deck = oneBody(quadGrid(2, 2, 1.0), material(MaterialType::pd_state, 3));
  deck.meshes[0].volumes = {1, 2, 3, 4};
  CHECK(DEMModel(deck, 1).state().volume == std::vector<Real>{1, 2, 3, 4});
}

TEST_CASE("model: the horizon is the material's or a multiple of the mesh size") {
  ModelDeck deck = oneBody(quadGrid(3, 3, 0.5), material(MaterialType::pd_state, 1.25));
  CHECK(DEMModel(deck, 1).particles()[0].horizon == 1.25);
  deck.zones[0].material.horizon_mesh_ratio = 3;
  CHECK(DEMModel(deck, 1).particles()[0].horizon == 1.5);
}

TEST_CASE("model: the influence function is the zone's own, in the original the first zone's") {
  for (const auto mode : {Compatibility::corrected, Compatibility::original}) {
    ModelDeck deck = oneZone(quadGrid(3, 3, h), material(MaterialType::pd_state, 3 * h));
    deck.compatibility = mode;
    deck.zones[0].material.influence = {InfluenceType::constant, {1.0}};
    deck.zones.push_back(deck.zones[0]);
    deck.zones[1].material.influence = {InfluenceType::constant, {5.0}};
    deck.bodies = {bodyAt(Vec3::Zero()), bodyAt(Vec3(1, 0, 0), 1)};
    deck.contacts.assign(4, contact(h, 1));
    DEMModel model(deck, 1);
    model.init();
    const Real ratio = mode == Compatibility::original ? 1 : 5;
    // The second body is 1 away, where coordinates round at 1e-16: lengths of 1e-3 at 1e-13.
    CHECK(std::abs(model.state().weighted_volume[9] / model.state().weighted_volume[0] - ratio) <
          1e-11);
  }
}

TEST_CASE("central difference step: forces of the old time, loads of the new one") {
  // One body under a force density A t: v_n = sum of dt A t_k / rho over k < n.
  DEMModel model(smallDeck(), 1);
  model.addForceSet(growingForce(model.state().size(), 1024));
  const Real dt = model.timeStep();
  model.start();
  Real v = 0;
  for (int n = 1; n <= 5; ++n) {
    v += dt * (dt * (n - 1));
    model.step();
    CHECK(model.n() == n);
    CHECK(model.time() == n * dt);
    for (std::size_t i = 0; i < model.state().size(); ++i) {
      CHECK(model.state().v[i][0] == v);
      CHECK(model.state().f[i][0] == 1024 * n * dt);
    }
  }
}

TEST_CASE("velocity Verlet step: half kicks with the forces of the old and of the new time") {
  DEMModel model(smallDeck(TimeScheme::velocity_verlet), 1);
  model.addForceSet(growingForce(model.state().size(), 1024));
  const Real dt = model.timeStep();
  model.start();
  for (int n = 1; n <= 5; ++n) {
    model.step();
    // v_n = sum dt / 2 (t_(k-1) + t_k) = t_n^2 / 2
    for (const Vec3& v : model.state().v) CHECK(v[0] == n * dt * n * dt / 2);
  }
}

TEST_CASE("step: prescribed motion comes before the forces of the same time") {
  // The second body is driven into the first; forces after n steps are those of its new place.
  for (const auto scheme : {TimeScheme::central_difference, TimeScheme::velocity_verlet}) {
    ModelDeck deck = pairDeck(1.0 * h, 3);
    deck.time_scheme = scheme;
    DEMModel model(deck, 1);
    model.addDisplacementSet(moveX(model.particles()[1], -0.08 * h / deck.timeStep()));
    model.start();
    const auto touching = [&] {
      return std::any_of(model.state().f.begin(), model.state().f.begin() + 9,
                         [](const Vec3& f) { return f.norm() > 0; });
    };
    CHECK_FALSE(touching());
    // The nearest nodes are (h - 0.08 h n, 0.3 h) apart: below Rc = 0.95 h from n = 2 on
    // (0.968, 0.891 by hand: sqrt(0.92^2 + 0.09), sqrt(0.84^2 + 0.09)).
    model.step();
    CHECK_FALSE(touching());
    model.step();
    CHECK(touching());
  }
}

TEST_CASE("start: initial velocity, then prescribed motion, then forces at time zero") {
  DEMModel model(pairDeck(0.5 * h), 1);
  model.addInitialVelocity({{0, 1}, Vec3(1, 2, 0)});
  model.addDisplacementSet(moveX(model.particles()[1], 3));
  model.start();
  CHECK(model.n() == 0);
  CHECK(model.time() == 0);
  CHECK(model.state().v[0] == Vec3(1, 2, 0));
  CHECK(model.state().v.back() == Vec3(3, 2, 0));
  CHECK(largestNorm(model.state().f) > 0);  // nodes closer than Rc
  model.state().v[0] = Vec3(9, 0, 0);
  model.start();  // done once
  CHECK(model.state().v[0] == Vec3(9, 0, 0));
}

TEST_CASE("run: takes all steps of the deck") {
  ModelDeck deck = smallDeck();
  deck.time_steps = 7;
  deck.final_time = 7e-7;
  DEMModel model(deck, 1);
  int calls = 0;
  model.run([&] { return ++calls < 0; });
  CHECK(calls == 7);
  CHECK(model.n() == 7);
  CHECK(relativeError(model.time(), 7e-7) < 10 * epsilon);
}

TEST_CASE("integrate: stops after the step in which the observer says so") {
  DEMModel model(smallDeck(), 1);
  CHECK(model.integrate(3) == 3);
  CHECK(model.integrate(10, [&] { return model.n() == 5; }) == 2);
  CHECK(model.n() == 5);
}

TEST_CASE("bodies that never move: no internal force but gravity, and no motion") {
  ModelDeck deck = pairDeck(5 * h);
  deck.bodies[0].constrained = true;
  deck.gravity = Vec3(0, -10, 0);
  DEMModel model(deck, 1);
  model.init();
  setDisplacement(model.state(), 0, Vec3(0.1 * h, 0, 0));
  model.integrate(3);
  CHECK(model.state().u[0] == Vec3(0.1 * h, 0, 0));
  for (std::size_t i = 0; i < 25; ++i) {
    CHECK(model.state().f[i] == Vec3(0, -12000, 0));
    CHECK(model.state().v[i] == Vec3(0, 0, 0));
    CHECK(model.state().v[i + 25][1] < 0);
  }
}

TEST_CASE("loads: fixity and force fixity carry the directions of the sets") {
  DEMModel model(smallDeck(), 1);
  auto set = moveX(model.particles()[0], 1);
  set.nodes = {3};
  set.amplitude = {1};
  model.addDisplacementSet(set);
  model.addForceSet(growingForce(2, 1));
  CHECK(model.state().fixity[3] == 1);
  CHECK(model.state().fixity[2] == 0);
  CHECK(model.state().force_fixity[1] == 1);
  CHECK(model.state().force_fixity[2] == 0);
}

TEST_CASE("loads: sets after the first step and unknown bodies are refused") {
  DEMModel model(smallDeck(), 1);
  CHECK(contains(messageOf([&] { model.addInitialVelocity({{1}, Vec3::Zero()}); }), "body 1"));
  model.start();
  CHECK_THROWS_AS(model.addForceSet(growingForce(1, 1)), InputError);
  CHECK_THROWS_AS(model.addDisplacementSet(moveX(model.particles()[0], 1)), InputError);
}

TEST_CASE("model: a deck that cannot be right is refused with a reason") {
  const auto message = [](auto&& change) {
    ModelDeck deck = smallDeck();
    change(deck);
    return messageOf([&] {
      DEMModel model(deck, 1);
      model.init();
    });
  };
  CHECK(message([](ModelDeck&) {}) == "");
  CHECK(contains(message([](ModelDeck& d) { d.dimension = 4; }), "Dimension"));
  CHECK(contains(message([](ModelDeck& d) { d.final_time = 0; }), "Final_Time"));
  CHECK(contains(message([](ModelDeck& d) { d.final_time = not_given; }), "Final_Time"));
  CHECK(contains(message([](ModelDeck& d) { d.time_steps = 0; }), "Time_Steps"));
  CHECK(contains(message([](ModelDeck& d) { d.bodies.clear(); }), "no bodies"));
  CHECK(contains(message([](ModelDeck& d) { d.bodies[0].zone = 1; }), "no such zone"));
  CHECK(contains(message([](ModelDeck& d) { d.bodies[0].scale = 0; }), "scale"));
  CHECK(contains(message([](ModelDeck& d) { d.zones[0].mesh = 1; }), "no such mesh"));
  CHECK(contains(message([](ModelDeck& d) { d.zones[0].material.density = 0; }), "density"));
  CHECK(contains(message([](ModelDeck& d) { d.zones[0].material.density = not_given; }), "Zone_1"));
  CHECK(
      contains(message([](ModelDeck& d) { d.zones[0].material.horizon = not_given; }), "horizon"));
  CHECK(contains(message([](ModelDeck& d) { d.bodies.push_back(d.bodies[0]); }), "Contact"));
  CHECK(contains(message([](ModelDeck& d) { d.meshes[0].points[1] = d.meshes[0].points[0]; }),
                 "coincide"));
  CHECK_THROWS_AS(DEMModel(smallDeck(), 0), InputError);
}

TEST_CASE("model: given volumes that are not one per node are refused") {
  ModelDeck deck = smallDeck();
  deck.meshes[0].volumes = {1, 2, 3};
  CHECK_THROWS_AS(DEMModel(deck, 1), InputError);
}

TEST_CASE("model: too few constants of a law are refused as bad input") {
  for (const auto type : {MaterialType::pd_state, MaterialType::pmb_bond, MaterialType::rnp_bond}) {
    ModelDeck deck = smallDeck();
    deck.zones[0].material.type = type;
    deck.zones[0].material.law_parameters = {1};
    DEMModel model(deck, 1);
    CHECK_THROWS_AS(model.init(), InputError);
  }
}

TEST_CASE("run: a velocity that is not a number stops it with step and body and node") {
  for (const auto scheme : {TimeScheme::central_difference, TimeScheme::velocity_verlet}) {
    ModelDeck deck = pairDeck(5 * h);
    deck.time_scheme = scheme;
    DEMModel model(deck, 1);
    model.integrate(4);
    model.state().f[25 + 7][1] = not_given;
    CHECK_THROWS_AS(model.step(), NumericalError);
    DEMModel again(deck, 1);
    again.integrate(4);
    again.state().f[25 + 7][1] = not_given;
    const std::string message = messageOf([&] { again.step(); });
    CHECK(contains(message, "step 5 "));
    CHECK(contains(message, "body 1"));
    CHECK(contains(message, "node 7"));
  }
}

TEST_CASE("run: a node that crosses its horizon within a step stops it") {
  ModelDeck deck = pairDeck(5 * h);
  DEMModel model(deck, 1);
  model.addInitialVelocity({{1}, Vec3(1.1 * 3 * h / deck.timeStep(), 0, 0)});
  const std::string message = messageOf([&] { model.integrate(1); });
  CHECK(contains(message, "body 1"));
  CHECK(contains(message, "smaller time step"));
}

TEST_CASE("functions from outside: once per step, at the time of its end") {
  for (const auto scheme : {TimeScheme::central_difference, TimeScheme::velocity_verlet}) {
    DEMModel model(smallDeck(scheme), 1);
    std::vector<Real> times;
    ForceSet force = growingForce(model.state().size(), 3);
    force.density.evaluate = [&](Real t, std::span<Vec3> values) {
      times.push_back(t);
      std::fill(values.begin(), values.end(), Vec3::Constant(t));
    };
    model.addForceSet(force);
    DEMModel built_in(smallDeck(scheme), 1);
    built_in.addForceSet(growingForce(model.state().size(), 3));  // 3 t
    model.integrate(3);
    built_in.integrate(3);
    const Real dt = model.timeStep();  // a power of two
    CHECK(times == std::vector<Real>{0, dt, 2 * dt, 3 * dt});
    CHECK(model.state().x == built_in.state().x);
    CHECK(model.state().f == built_in.state().f);
  }
}

TEST_CASE("functions from outside: one that throws leaves the step before") {
  DEMModel model(smallDeck(TimeScheme::velocity_verlet), 1);
  ForceSet force = growingForce(model.state().size(), 3);
  bool fails = false;
  force.density.evaluate = [&](Real, std::span<Vec3> values) {
    if (fails) throw std::runtime_error("no more");
    std::fill(values.begin(), values.end(), Vec3::Constant(1));
  };
  model.addForceSet(force);
  model.integrate(2);
  const State before = model.state();
  fails = true;
  CHECK(messageOf([&] { model.step(); }) == "no more");
  CHECK(model.n() == 2);
  CHECK(model.state().x == before.x);
  CHECK(model.state().v == before.v);
  fails = false;
  model.step();
  CHECK(model.n() == 3);
}

TEST_CASE("duration: sets the time step, before the first step only") {
  DEMModel model(smallDeck(), 1);
  model.init();
  model.setDuration(1, 4096);
  CHECK(model.timeStep() == 1.0 / 4096);
  CHECK_THROWS_AS(model.setDuration(0, 1), InputError);
  CHECK_THROWS_AS(model.setDuration(1, 0), InputError);
  model.start();
  CHECK_THROWS_AS(model.setDuration(1, 8192), InputError);
}

TEST_CASE("touching nodes: pairs closer than the contact radius, each once") {
  DEMModel model(pairDeck(0.5 * h), 1);
  const auto pairs = model.touchingNodes();
  const auto& x = model.state().x;
  std::vector<std::pair<Index, Index>> expected;
  for (Index i = 0; i < 25; ++i)
    for (Index j = 25; j < 50; ++j)
      if ((x[static_cast<std::size_t>(i)] - x[static_cast<std::size_t>(j)]).norm() < 0.95 * h)
        expected.emplace_back(i, j);
  CHECK(!expected.empty());
  CHECK(pairs == expected);
}

TEST_CASE("contact forces alone: leave the state as it is and agree with the whole") {
  DEMModel model(pairDeck(0.5 * h), 1);
  model.start();
  const auto whole = model.state().f;  // no deformation yet: contact only
  CHECK(model.contactForces() == whole);
  CHECK(model.state().f == whole);
}

TEST_CASE("stable time step: of a pair of nodes it is the limit of the pair's oscillation") {
  // V = 1, J = 1, r = 1: f = 18 K e, so omega^2 = 36 K / rho (test_peridynamic.cpp derives f).
  MaterialDeck m = material(MaterialType::pd_state, 2);
  m.influence = {InfluenceType::constant, {1.0}};
  Mesh mesh;
  mesh.points = {{0, 0, 0}, {1, 0, 0}};
  mesh.volumes = {1, 1};
  ModelDeck deck = oneBody(mesh, m);
  deck.time_scheme = TimeScheme::velocity_verlet;
  const Real limit = 2 / std::sqrt(36 * 2.16e7 / 1200);
  const auto amplitude = [&](Real dt) {
    deck.time_steps = 40;
    deck.final_time = 40 * dt;
    DEMModel model(deck, 1);
    model.init();
    CHECK(relativeError(model.stableTimeStep().bonds, limit) < 20 * epsilon);
    setDisplacement(model.state(), 1, Vec3(1e-9, 0, 0));
    Real largest = 0;
    model.run([&] {
      largest = std::max(largest, std::abs(model.state().u[1][0] - model.state().u[0][0]));
      return false;
    });
    return largest;
  };
  // Below the limit u_n = u_0 cos(n phi); above, each step multiplies by 1.33 (omega dt = 2.02).
  // e = |y| - 1 of 1e-9 has six digits, hence the 1 % margin.
  CHECK(amplitude(0.99 * limit) < 1.01e-9);
  CHECK(amplitude(1.01 * limit) > 1e-6);
}

TEST_CASE("stable time step: of a pair with a bond law it parts bounded from growing motion") {
  // r = 1/4, so that lengths and their inverses differ. For a pair the bound is exact; thresholds
  // as in the test before.
  for (const auto type :
       {MaterialType::pmb_bond, MaterialType::pd_elastic_bond, MaterialType::rnp_bond}) {
    CAPTURE(static_cast<int>(type));
    Mesh mesh;
    mesh.points = {{0, 0, 0}, {0.25, 0, 0}};
    mesh.volumes = {1, 1};
    ModelDeck deck = oneBody(mesh, material(type, 2));
    deck.time_scheme = TimeScheme::velocity_verlet;
    deck.time_steps = 40;
    DEMModel probe(deck, 1);
    probe.init();
    const Real limit = probe.stableTimeStep().bonds;
    const auto amplitude = [&](Real dt) {
      deck.final_time = 40 * dt;
      DEMModel model(deck, 1);
      model.init();
      setDisplacement(model.state(), 1, Vec3(1e-9, 0, 0));
      Real largest = 0;
      model.run([&] {
        largest = std::max(largest, std::abs(model.state().u[1][0] - model.state().u[0][0]));
        return false;
      });
      return largest;
    };
    CHECK(amplitude(0.99 * limit) < 1.01e-9);
    CHECK(amplitude(1.01 * limit) > 1e-6);
  }
}

TEST_CASE(
    "stable time step: that of contact is the smallest over all pairs of bodies that may touch") {
  // Three zones, the last of them walls; one body in two never moves. In turn each zone is left
  // with one body, so that the largest one has only others of its kind, or none.
  for (const Index lone : {0, 1, 2}) {
    const Real spacing = 0.1;
    ModelDeck deck = oneZone(quadGrid(4, 4, spacing), material(MaterialType::pd_state, 0.3));
    deck.zones.resize(3, deck.zones[0]);
    deck.zones[1].material.density = 700;
    deck.zones[2].is_wall = true;
    deck.contacts.resize(9, contact(0.9 * spacing, 1e12));
    deck.contacts[1].kn = deck.contacts[3].kn = 3e12;
    deck.contacts[4].kn = 5e11;
    Random random(4);
    for (Index k = 0; k < 12; ++k) {
      if (k % 3 == lone && k >= 3) continue;
      BodyDeck body = bodyAt(Vec3(static_cast<Real>(k), 0, 0), k % 3);
      body.scale = 1 + 0.5 * random();
      body.constrained = k % 2 == 1;
      deck.bodies.push_back(body);
    }
    DEMModel model(deck, 2);
    model.init();
    Real omega_squared = 0;
    for (const Particle& p : model.particles())
      for (const Particle& q : model.particles()) {
        if (p.constrained || !mayTouch(p, q)) continue;
        const Real node_volume = q.volume / static_cast<Real>(q.nodes());
        omega_squared = std::max(omega_squared, model.contact().law(p, q).kn * node_volume *
                                                    (1 / p.density + 1 / q.density));
      }
    CHECK(model.stableTimeStep().contact == 2 / std::sqrt(omega_squared));
  }
}

TEST_CASE("stable time step: that of self-contact is of bodies whose bonds can break") {
  const Real spacing = 0.1;
  const auto make = [](MaterialType type, Real fracture_energy) {
    MaterialDeck m = material(type, 0.3);
    m.fracture_energy = fracture_energy;
    return m;
  };
  // s0 = 0.1 (0.06 for bonds), and far above 1
  const Real brittle = 1e5, tough = 1e12;
  const auto limit = [&](const MaterialDeck& m, bool held) {
    ModelDeck deck = oneBody(quadGrid(4, 4, spacing), m);
    deck.bodies[0].constrained = held;
    DEMModel model(deck, 1);
    model.init();
    const Particle& body = model.particles()[0];
    // w'' = -Kn V 2/rho w of two nodes that the spring keeps apart
    const Real volume = body.volume / static_cast<Real>(body.nodes());
    const Real expected = 2 / std::sqrt(2 * body.self_contact_kn * volume / body.density);
    return model.stableTimeStep().self_contact / expected;
  };
  for (const auto type : {MaterialType::pd_state, MaterialType::pmb_bond, MaterialType::rnp_bond}) {
    CAPTURE(static_cast<int>(type));
    CHECK(relativeError(limit(make(type, brittle), false), 1) < 4 * epsilon);
    CHECK(std::isinf(limit(make(type, brittle), true)));
    CHECK(std::isinf(limit(make(type, tough), false)));
  }
  CHECK(std::isinf(limit(make(MaterialType::pd_elastic_bond, brittle), false)));
}

TEST_CASE("stable time step: needs bonds, so init first") {
  CHECK_THROWS_AS(DEMModel(smallDeck(), 1).stableTimeStep(), InputError);
}

TEST_CASE("timings and memory: grow with the work") {
  DEMModel model(smallDeck(), 1);
  model.integrate(10);
  CHECK(model.timings().setup > 0);
  CHECK(model.timings().peridynamic > 0);
  // At least the bonds: a node number and a flag in the table, a length and an influence by pairs.
  CHECK(model.memoryBytes() > model.bonds().size() * (5 + 8));
}

TEST_CASE("model: 1 and 2 and 4 threads give the same bits over a collision") {
  // Large enough that every loop with a threshold for threads runs in parallel.
  const auto run = [](int threads) {
    ModelDeck deck = pairDeck(0.2 * h, 66);
    deck.contacts[0].friction_on = deck.contacts[0].damping_on = true;
    deck.contacts[0].friction_coeff = 0.3;
    deck.contacts[0].epsilon = 0.8;
    deck.zones[0].material.fracture_energy *= 1e-6;  // breaks at the contact
    DEMModel model(deck, threads);
    model.addInitialVelocity({{0}, Vec3(20, 0, 0)});
    model.integrate(12);
    return model;
  };
  const DEMModel one = run(1);
  const auto& intact = one.bonds().intact;
  CHECK(std::count(intact.begin(), intact.end(), 0) > 0);
  for (const int threads : {2, 4}) {
    const DEMModel many = run(threads);
    CHECK(many.state().x == one.state().x);
    CHECK(many.state().v == one.state().v);
    CHECK(many.state().f == one.state().f);
    CHECK(many.state().damage_z == one.state().damage_z);
    CHECK(many.bonds().intact == intact);
  }
}
