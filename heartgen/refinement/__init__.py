"""x"""
from heartgen.refinement.distances import misfit
from heartgen.refinement.policy import FitSettings, optimize
from heartgen.refinement.target import FitTarget, fit_target
