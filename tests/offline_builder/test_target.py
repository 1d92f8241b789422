"""What is in a bundle's folder already is not lost unasked."""

import pytest
from ema_offline_builder.config import Builder
from ema_offline_builder.target import check

from ema.bundle import load
from ema.core.errors import BundleError


@pytest.fixture
def builder(coarse_bundle):
    return Builder.model_validate(coarse_bundle.manifest["builder"])


@pytest.fixture
def bundle(coarse_bundle, tmp_path):
    """A copy of a bundle."""
    out = tmp_path / "bundle"
    out.mkdir()
    for path in coarse_bundle.path.iterdir():
        (out / path.name).write_bytes(path.read_bytes())
    return out


def test_the_same_configuration_may_be_built_again(bundle, builder, shipped_plant):
    check(bundle, builder, shipped_plant)
    check(bundle.with_name("new"), builder, shipped_plant)


def test_another_configuration_or_plant_is_refused_without_force(bundle, builder, shipped_plant):
    other = builder.model_copy(update={"seed": builder.seed + 1})
    stiffer = shipped_plant.model_copy(update={"name": "another"})
    for configured, plant in ((other, shipped_plant), (builder, stiffer)):
        with pytest.raises(BundleError, match=r"bundle: is the bundle of another configuration or plant.*--force"):
            check(bundle, configured, plant)
        check(bundle, configured, plant, replace=True)
    assert load(bundle).plant == shipped_plant


@pytest.mark.parametrize("replace", [False, True])
def test_files_that_are_no_part_of_a_bundle_are_never_lost(bundle, builder, shipped_plant, replace):
    (bundle / "notes.txt").write_text("mine")
    with pytest.raises(BundleError, match=r"holds files that are none of a bundle \(notes\.txt\)"):
        check(bundle, builder, shipped_plant, replace)


def test_a_damaged_bundle_is_replaced_by_force_only(bundle, builder, shipped_plant):
    (bundle / "manifest.json").write_text("{")
    with pytest.raises(BundleError, match="another configuration"):
        check(bundle, builder, shipped_plant)
    check(bundle, builder, shipped_plant, replace=True)
