"""Multi-UAS area coverage with a physical battery: one world for every planner.

Importing the package registers the environments with Gymnasium and PettingZoo, nothing else: its
names are imported when they are first asked for, from where `__init__.pyi` says.
"""

from uas_coverage_env.interruptions import ctrl_c_ends_the_program

with ctrl_c_ends_the_program():
    import lazy_loader

    from uas_coverage_env.registration import register_environments, successor_of

    _found, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)

    register_environments()


def __getattr__(name: str) -> object:
    successor = successor_of(name)
    if successor:
        raise ImportError(f"{name} is gone; take {successor}")
    return _found(name)
