# The service, the dashboard, and Dask's scheduler and workers: one image, one command each.
FROM python:3.11-slim-bookworm

# VTK draws without a screen through EGL and Mesa's software renderer.
RUN apt-get update && apt-get install -y --no-install-recommends libegl1 libgl1-mesa-dri \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /heartgen
COPY . .
# The versions that are tested; of the lock, without the tools that only tests need.
RUN sed -E '/^ +--hash/d; s/ \\$//' requirements.lock > /tmp/constraints.txt \
    && pip install --no-cache-dir -c /tmp/constraints.txt ".[service,apps,dicom]"

RUN useradd --create-home --uid 1000 heartgen \
    && mkdir /data && chown heartgen /data
USER heartgen
# The first fit compiles the kernels; no user should have to wait for it.
ENV NUMBA_CACHE_DIR=/home/heartgen/numba
RUN python -c "import heartgen; heartgen.personalize(heartgen.samples.biv(2.0).mask)"

ENV HEARTGEN_DATA=/data HEARTGEN_HOST=0.0.0.0
VOLUME /data
EXPOSE 8000
CMD ["heartgen", "serve"]
